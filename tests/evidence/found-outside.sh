#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Defects that users found, line by line: reproduction, before, after, and the tests for them; then the long trials of the same defects.
# Each area has its lines in found-outside/AREA.sh.
. "$(dirname "$0")/common.sh"

lines=""
# test_passes PROGRAM:FILTER | script:PATH: runs the test once for these sources. A filter that selects no test does not pass.
test_passes() {
  local name=${1//[^A-Za-z0-9_.-]/_}
  if [[ $1 == script:* ]]; then
    step "$name" bash "${1#script:}" "$twocone" "$PWD"
    [ "$(passed "$name")" = yes ]
  else
    step "$name" "build/release/tests/${1%%:*}" --gtest_filter="${1#*:}"
    [ "$(passed "$name")" = yes ] && grep -qE '^\[  PASSED  \] [1-9]' "$work/$name.log"
  fi
}
# found ID REPRODUCTION BEFORE AFTER TEST...
found() {
  local id=$1 reproduction=$2 before=$3 after=$4 met=yes tests=""
  shift 4
  for t in "$@"; do
    test_passes "$t" || { met=no; unmet=$((unmet + 1)); report "$id: $t does not pass"; }
    tests+="${tests:+, }\`$t\`"
  done
  lines+="| $id | $reproduction | $before | $after | $tests | $met |"$'\n'
}
# answered ID REPRODUCTION WHY: the behaviour is correct
answered() { lines+="| $1 | $2 | | correct behaviour: $3 | | |"$'\n'; }

for area in tests/evidence/found-outside/*.sh; do . "$area"; done
# The fresh Debian systems have a separate page, which must be made again after every change of the set-up.
trixie=$(grep 'fresh trixie' "$pages/fresh-debian.md" || echo '| no |')
lines+="| F | fresh Debian 13: \`./demo.sh\` | a compile error: a false warning of g++ 14 is an error in every preset | warnings are errors only where TWOCONE_WARNINGS_AS_ERRORS is set, as \`.ci/run\` does | [fresh-debian](fresh-debian.md) | $(grep -q '| no |$' <<<"$trixie" && echo no || echo yes) |"$'\n'

blocks+=$'\n'"## Line by line"$'\n\n'"Tests are programs below build/release/tests with their filters, or scripts. \`met\`: they pass in this commit."$'\n\n'
blocks+="| line | reproduction | before | after | tests | met |"$'\n'"|---|---|---|---|---|---|"$'\n'"$(sort -V <<<"${lines%$'\n'}")"$'\n'
page "defects that users found"
