# SPDX-License-Identifier: Apache-2.0
# The scripts of this folder source this file. They are called with the program and the source tree: SCRIPT.sh TWOCONE SOURCE_DIR
set -u
twocone=$(realpath "$1")
source_dir=$(realpath "$2")
work=$(mktemp -d "${TMPDIR:-/tmp}/twocone_test_XXXXXX")
trap 'rm -rf "$work"' EXIT
failures=0
skipped=0

fail() { echo "FAILED: $*" >&2; failures=$((failures + 1)); }

skip() { echo "SKIPPED: $*" >&2; skipped=$((skipped + 1)); }

# Exits with 1 if a check failed, and with 77, which ctest reports as skipped, if a check was skipped and all others passed.
finish() {
  if ((failures)); then echo "$failures failed" >&2; exit 1; fi
  if ((skipped)); then exit 77; fi
  echo "all checks passed"
}
