#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Sets everything up, builds and runs the tests.
#   ./test.sh [PRESET] [--no-skips]   dev (default), release, asan or tsan; --no-skips: a test that is skipped is a failure
#   ./test.sh --lint [product]        clang-format and clang-tidy, as errors; product: without tests and benchmarks
set -euo pipefail
cd "$(dirname "$0")"

preset=dev
skips_allowed=yes
lint=no
folders=()
for argument; do
  case "$argument" in
    dev | release | asan | tsan) preset=$argument ;;
    --no-skips) skips_allowed=no ;;
    --lint) lint=yes ;;
    product) folders=(base hal vision localisation drivers apps) ;;
    *)
      echo "test.sh: '$argument' is no preset; there are: dev release asan tsan, and --no-skips, --lint [product]" >&2
      exit 2
      ;;
  esac
done

if [ "$lint" = yes ]; then
  cmake/setup.sh --lint
  git ls-files '*.cpp' '*.h' | grep -v '^tests/layers/bad/' | xargs clang-format --dry-run --Werror
  # Clang cannot read headers that GCC has precompiled.
  cmake --preset dev -B build/lint -DTWOCONE_PRECOMPILE=OFF -DTWOCONE_BUILD_FUZZERS=ON -DTWOCONE_BUILD_BENCHMARKS=ON -DTWOCONE_BUILD_VM_PROGRAMS=ON
  git ls-files -- "${folders[@]}" | grep '\.cpp$' | grep -v '^examples/\|^tests/layers/bad/' |
    xargs -P "$(nproc)" -n 4 clang-tidy -p build/lint --quiet --extra-arg=-Wno-unknown-warning-option
  exit
fi

cmake/setup.sh
cmake --preset "$preset"
cmake --build --preset "$preset"
results=$PWD/build/$preset/tests.xml
ctest --preset "$preset" --output-junit "$results"
skipped=$(grep -o '<testcase name="[^"]*"[^>]*status="notrun"' "$results" | sed 's/<testcase name="\([^"]*\)".*/\1/' || true)
if [ -n "$skipped" ]; then
  echo "test.sh: $(wc -l <<<"$skipped") tests were skipped:"
  sed 's/^/  /' <<<"$skipped"
  [ "$skips_allowed" = yes ] || exit 1
else
  echo "test.sh: no test was skipped"
fi
