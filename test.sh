#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Sets everything up, builds and runs the tests.
#   ./test.sh [PRESET]       dev (default), release, asan or tsan
#   ./test.sh --lint         clang-format and clang-tidy, as errors
set -euo pipefail
cd "$(dirname "$0")"
case "${1:-dev}" in
  dev | release | asan | tsan)
    cmake/setup.sh
    cmake --workflow --preset "${1:-dev}"
    ;;
  --lint)
    cmake/setup.sh --lint
    git ls-files '*.cpp' '*.h' | grep -v '^tests/layers/bad/' | xargs clang-format --dry-run --Werror
    # Clang cannot read what GCC has precompiled.
    cmake --preset dev -B build/lint -DTWOCONE_PRECOMPILE=OFF
    git ls-files '*.cpp' | grep -v '^examples/\|^tests/layers/bad/' | xargs -P "$(nproc)" -n 4 clang-tidy -p build/lint --quiet --extra-arg=-Wno-unknown-warning-option
    ;;
  *)
    echo "test.sh: '$1' is no preset; there are: dev release asan tsan, and --lint" >&2
    exit 2
    ;;
esac
