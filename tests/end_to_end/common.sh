# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts of this folder, which are called with the program and the tree: SCRIPT.sh TWOCONE SOURCE_DIR
set -u
twocone=$(realpath "$1")
source_dir=$(realpath "$2")
work=$(mktemp -d "${TMPDIR:-/tmp}/twocone_test_XXXXXX")
trap 'rm -rf "$work"' EXIT
failures=0
skipped=0

fail() { echo "FAILED: $*" >&2; failures=$((failures + 1)); }

skip() { echo "SKIPPED: $*" >&2; skipped=$((skipped + 1)); }

# Exit status 1 if anything failed; 77, which ctest reports as skipped, if all that was tried passed but something was not tried.
finish() {
  if ((failures)); then echo "$failures failed" >&2; exit 1; fi
  if ((skipped)); then exit 77; fi
  echo "all as promised"
}
