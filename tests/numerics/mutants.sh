#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Breaks one formula after another in a copy of the sources, expects the named test to fail, and prints "caught" or "SURVIVED"
# for each line of mutants.txt. Ends with 1 if one survives, with 2 if a line of the list is wrong or the unbroken tests fail.
#   tests/numerics/mutants.sh [WORD]     WORD: only the lines of the list that contain it
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
list=tests/numerics/mutants.txt
word=${1:-}
jobs=${TWOCONE_JOBS:-1}
configure_s=300
build_s=1800  # for the first build; a mutant rebuilds one file
test_s=300    # this catches a mutant that makes a loop endless

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
mkdir "$work/source"
# Copy tracked and new files, without ignored ones.
git ls-files -z --cached --others --exclude-standard | while IFS= read -r -d '' file; do
  if [ -f "$file" ]; then printf '%s\0' "$file"; fi
done | tar --null -T - -cf - | tar -xf - -C "$work/source"

fail() {
  echo "mutants.sh: $*" >&2
  exit 2
}
build() { timeout "$build_s" cmake --build "$work/build" -j "$jobs" --target "$@" >"$work/build.log" 2>&1; }

files=() olds=() news=() tests=()
number=0
while IFS= read -r line; do
  number=$((number + 1))
  if [[ $line == '' || $line == '#'* || $line != *"$word"* ]]; then continue; fi
  rest=$line
  parts=()
  while [[ $rest == *' | '* ]]; do
    parts+=("${rest%%' | '*}")
    rest=${rest#*' | '}
  done
  parts+=("$rest")
  [ "${#parts[@]}" = 4 ] || fail "$list:$number: ${#parts[@]} parts, expected FILE | OLD | NEW | TEST [FILTER]"
  [ -f "$work/source/${parts[0]}" ] || fail "$list:$number: there is no ${parts[0]}"
  text=$(cat "$work/source/${parts[0]}")
  after=${text#*"${parts[1]}"}
  [ "$after" != "$text" ] || fail "$list:$number: ${parts[0]} does not hold: ${parts[1]}"
  [[ $after != *"${parts[1]}"* ]] || fail "$list:$number: ${parts[0]} holds this more than once: ${parts[1]}"
  files+=("${parts[0]}") olds+=("${parts[1]}") news+=("${parts[2]}") tests+=("${parts[3]}")
done <"$list"
[ "${#files[@]}" -gt 0 ] || fail "$list has no line with '$word'"

mapfile -t targets < <(printf '%s\n' "${tests[@]%% *}" | sort -u)
# Build with optimisation and without assertions: the test itself must catch a mutant.
timeout "$configure_s" cmake -S "$work/source" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -DNDEBUG" \
  -DTWOCONE_BUILD_BENCHMARKS=OFF >"$work/configure.log" 2>&1 || fail "cannot configure: $(tail -n 20 "$work/configure.log")"
build "${targets[@]}" || fail "the unbroken sources do not build: $(tail -n 20 "$work/build.log")"

run() { # run TEST [FILTER]: status of the test, 124 if it does not end
  local program
  program=$(find "$work/build" -type f -name "$1" -perm -u+x)
  timeout "$test_s" "$program" --gtest_brief=1 "--gtest_filter=${2:-*}" >"$work/test.log" 2>&1
}
mapfile -t distinct < <(printf '%s\n' "${tests[@]}" | sort -u)
for test in "${distinct[@]}"; do
  # shellcheck disable=SC2086
  run $test || fail "'$test' fails on the unbroken sources: $(tail -n 20 "$work/test.log")"
  if grep -q "Running 0 tests\|0 tests ran\|PASSED  . 0 test" "$work/test.log"; then fail "'$test' names no test"; fi
done

caught=0
survived=0
printf '%-8s  %-38s  %s\n' result file 'old -> new (test)'
for i in "${!files[@]}"; do
  file=$work/source/${files[i]}
  cp -p "$file" "$work/whole"
  text=$(cat "$file")
  printf '%s\n' "${text%%"${olds[i]}"*}${news[i]}${text#*"${olds[i]}"}" >"$file"
  # shellcheck disable=SC2086
  if ! build ${tests[i]%% *}; then
    fail "this mutant does not compile: ${files[i]}: ${olds[i]} -> ${news[i]}: $(grep -m 5 'error' "$work/build.log")"
  fi
  status=0
  # shellcheck disable=SC2086
  run ${tests[i]} || status=$?
  if [ "$status" = 0 ]; then
    result=SURVIVED
    survived=$((survived + 1))
  else
    result=caught
    caught=$((caught + 1))
  fi
  printf '%-8s  %-38s  %s -> %s (%s)\n' "$result" "${files[i]}" "${olds[i]}" "${news[i]}" "${tests[i]}"
  cp "$work/whole" "$file"  # its modification time is new, so that it is built again
done
echo "$caught of ${#files[@]} mutants caught, $survived survived"
[ "$survived" = 0 ]
