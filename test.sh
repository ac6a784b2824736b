#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Sets everything up, builds and runs the tests.
#   ./test.sh [PRESET] [--no-skips] [ROOM...]   PRESET: dev (default), release, asan or tsan; --no-skips: a test that is
#                                               skipped is a failure; ROOM...: only the tests of these folders of tests/,
#                                               under a sanitizer without those named ...Seeds
#   ./test.sh --lint [product]                  clang-format and clang-tidy, as errors; product: without tests and benchmarks
set -euo pipefail
cd "$(dirname "$0")"

preset=dev
skips_allowed=yes
lint=no
others=ON
rooms=()
for argument; do
  case "$argument" in
    dev | release | asan | tsan) preset=$argument ;;
    --no-skips) skips_allowed=no ;;
    --lint) lint=yes ;;
    product) others=OFF ;;
    *)
      if [ ! -f "tests/$argument/CMakeLists.txt" ]; then
        echo "test.sh: '$argument' is no preset and no folder of tests/; there are: dev release asan tsan, --no-skips, --lint [product], and" \
          "$(cd tests && ls -d */CMakeLists.txt | sed 's|/.*||' | xargs)" >&2
        exit 2
      fi
      rooms+=("tests/$argument")
      ;;
  esac
done

if [ "$lint" = yes ]; then
  cmake/setup.sh --lint
  git ls-files '*.cpp' '*.h' | grep -v '^tests/layers/bad/' | xargs clang-format --dry-run --Werror
  # Most of the time goes into headers, so files are read several at once, as they are compiled. Clang cannot read headers
  # that GCC has precompiled.
  cmake --preset dev -B build/lint -DTWOCONE_PRECOMPILE=OFF -DTWOCONE_BUILD_TESTS="$others" -DTWOCONE_BUILD_BENCHMARKS="$others" \
    -DTWOCONE_BUILD_FUZZERS="$others" -DTWOCONE_BUILD_VM_PROGRAMS="$others"
  cmake --build build/lint --target twocone_foxglove # what others include of it is generated
  sed -n 's/^ *"file": "\(.*\)".*/\1/p' build/lint/compile_commands.json |
    grep -v '/version\.cpp$\|/embedded_page\.cpp$\|/twocone_foxglove\.dir/' |
    xargs -P "$(nproc)" -n 1 clang-tidy -p build/lint --quiet --extra-arg=-Wno-unknown-warning-option
  exit
fi

cmake/setup.sh
cmake --preset "$preset"
results=()
status=0
if ((${#rooms[@]})); then
  cmake --build --preset "$preset" --target "${rooms[@]/%//all}"
  # A test preset runs all folders. This is what it says of environment and jobs.
  export OMP_WAIT_POLICY=passive TSAN_OPTIONS=suppressions=$PWD/tests/tsan_suppressions.txt
  # Tests named ...Seeds repeat one computation with other random numbers. A sanitizer finds nothing new in that, at several
  # times the cost.
  case "$preset" in
    asan | tsan)
      export GTEST_FILTER='-*Seeds'
      echo "test.sh: under a sanitizer the tests named ...Seeds are left out"
      ;;
  esac
  for room in "${rooms[@]}"; do
    results+=("$PWD/build/$preset/$room/tests.xml")
    ctest --test-dir "build/$preset/$room" -j 6 --output-on-failure --no-tests=error --output-junit "${results[-1]}" || status=1
  done
else
  cmake --build --preset "$preset"
  results=("$PWD/build/$preset/tests.xml")
  ctest --preset "$preset" --output-junit "${results[0]}" || status=1
fi
# A test that ctest starts by itself is skipped in ctest's results; of several in one process, gtest alone knows.
skipped=$({
  grep -ho '<testcase name="[^"]*"[^>]*status="notrun"' "${results[@]}" | sed 's/<testcase name="\([^"]*\)".*/\1/' || true
  sed -n 's/^\[  SKIPPED \] \(.*\) ([0-9]* ms)$/\1/p' "${results[@]/%tests.xml/Testing/Temporary/LastTest.log}"
} | sort -u)
if [ -n "$skipped" ]; then
  echo "test.sh: $(wc -l <<<"$skipped") tests were skipped:"
  sed 's/^/  /' <<<"$skipped"
  [ "$skips_allowed" = yes ] || status=1
else
  echo "test.sh: no test was skipped"
fi
exit "$status"
