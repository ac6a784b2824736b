#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What takes too long for .ci/run: all tests under each sanitizer and optimised, the product as clang compiles it, clang-tidy over
# tests and benchmarks, and the tests without a single skip.
. "$(dirname "$0")/common.sh"

tests_of() { sed -n 's/^\([0-9]*% tests passed.*\)/\1/p' "$work/$1.log" | tail -n 1; }
for preset in dev release asan tsan; do
  no_skips=""
  [ "$preset" != dev ] || no_skips=--no-skips
  step "preset_$preset" ./test.sh "$preset" $no_skips
  row "./test.sh $preset $no_skips" "$(tests_of "preset_$preset")" "all pass" "$(passed "preset_$preset")"
done
for sanitizer in address,undefined thread; do
  preset=$([ "$sanitizer" = thread ] && echo tsan || echo asan)
  reports=$(grep -cE 'ERROR: AddressSanitizer|runtime error:|WARNING: ThreadSanitizer' "$work/preset_$preset.log" || true)
  row "reports of -fsanitize=$sanitizer" "$reports" 0 "$(holds "$reports == 0")"
done
step clang bash -c 'cmake --preset release -B build/clang -DCMAKE_CXX_COMPILER=clang++ -DTWOCONE_BUILD_BENCHMARKS=OFF && cmake --build build/clang'
row "everything compiles with clang" "$(clang++ --version | head -n 1)" "no error" "$(passed clang)"
step lint ./test.sh --lint
row "clang-format and clang-tidy over all files" "$(grep -c 'error:' "$work/lint.log" || true) findings" 0 "$(passed lint)"
page "checks that are too long for every push"
