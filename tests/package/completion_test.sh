#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests cmake/completion.bash with the program's own help.
#   completion_test.sh FOLDER_OF_TWOCONE SOURCE_DIR
set -euo pipefail
PATH=$1:$PATH
source "$2/cmake/completion.bash"
compopt() { :; } # it works during a completion only
failed=0
# expect COMPLETIONS WORD...: the last word is completed
expect() {
  local expected=$1
  shift
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  _twocone
  [ "${COMPREPLY[*]}" = "$expected" ] || { echo "'$*': '${COMPREPLY[*]}' in the place of '$expected'"; failed=1; }
}
expect "scan" twocone sc
expect "report" twocone help rep
expect "--behaviour" twocone run --beh
expect "wander waypoints" twocone run --behaviour wa
expect "native" twocone run --renderer nat
expect "as-built" twocone as
cd "$2"
expect "scenes/lab.map.yaml" twocone localise --map scenes/lab.map
expect "README.md" twocone report READ
expect "--v4l2-loopback" twocone serve --v4
expect "README.md" twocone export runs/demo READ 2>"$1/completion.errors"
[ ! -s "$1/completion.errors" ] || { cat "$1/completion.errors"; failed=1; }
exit $failed
