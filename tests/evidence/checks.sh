#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# How long ./test.sh takes from nothing, and .ci/run after it, part by part. Then what takes too long for .ci/run: all tests under each
# sanitizer and optimised, the product as clang compiles it, clang-tidy over tests and benchmarks, and the tests without a single skip.
. "$(dirname "$0")/common.sh"

# The packages are installed; fresh-debian measures their installation too.
tree=$work/tree
from_nothing() {
  rm -rf "$tree"
  git clone -q . "$tree"
  local begin=$SECONDS
  (cd "$tree" && ./test.sh) || return 1
  echo "took $((SECONDS - begin)) s"
}
step from_nothing from_nothing
minutes() { if [ -n "$1" ]; then awk "BEGIN { printf \"%d min %d s\", $1 / 60, $1 % 60 }"; else echo none; fi; }
all_s=$(sed -n 's/^took \([0-9]*\) s$/\1/p' "$work/from_nothing.log")
tests_s=$(sed -n 's/^Total Test time (real) = *\([0-9]*\).*/\1/p' "$work/from_nothing.log" | tail -n 1)
row "./test.sh from nothing, in a fresh clone" "$(minutes "$all_s")" "at most 10 min" "$(holds "${all_s:-9999} <= 600")"
row "of it, the tests" "$(minutes "$tests_s"); $(grep -E 'tests passed' "$work/from_nothing.log" | tail -n 1)" "at most 4 min" "$(holds "${tests_s:-9999} <= 240")"
ci() {
  local begin=$SECONDS
  (cd "$tree" && .ci/run) || return 1
  echo "took $((SECONDS - begin)) s"
}
step ci ci
ci_s=$(sed -n 's/^took \([0-9]*\) s$/\1/p' "$work/ci.log")
row ".ci/run, after ./test.sh in the same clone" "$(minutes "$ci_s"): $(sed -n 's|^.ci/run: \(.*\) took \(.*\)|\1 \2|p' "$work/ci.log" | paste -sd, | sed 's/,/, /g')" "at most 45 min" "$(holds "${ci_s:-9999} <= 2700")"

# found STEP PATTERN: how many lines of the step's output match, or that it was not run
found() { if [ "$(status_of "$1")" = "not run" ]; then echo "not run"; else grep -cE "$2" "$work/$1.log" || true; fi; }
tests_of() { grep -oE '^[0-9]+% tests passed.*' "$work/$1.log" | tail -n 1 || status_of "$1"; }
for preset in dev release asan tsan; do
  no_skips=""
  [ "$preset" != dev ] || no_skips=--no-skips
  step "preset_$preset" ./test.sh "$preset" $no_skips
  row "./test.sh $preset $no_skips" "$(tests_of "preset_$preset")" "all pass" "$(passed "preset_$preset")"
done
for sanitizer in address,undefined thread; do
  preset=$([ "$sanitizer" = thread ] && echo tsan || echo asan)
  reports=$(found "preset_$preset" 'ERROR: AddressSanitizer|runtime error:|WARNING: ThreadSanitizer')
  row "reports of -fsanitize=$sanitizer" "$reports" 0 "$(holds "\"$reports\" == \"0\"")"
done
step clang bash -c 'cmake --preset release -B build/clang -DCMAKE_CXX_COMPILER=clang++ -DTWOCONE_BUILD_BENCHMARKS=OFF && cmake --build build/clang'
row "errors when $(clang++ --version | head -n 1) compiles everything" "$(found clang 'error:')" 0 "$(passed clang)"
step lint ./test.sh --lint
row "findings of clang-format and clang-tidy over all files" "$(found lint 'error:')" 0 "$(passed lint)"
page "checks that are too long for every push"
