#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Measures what the project claims, in full length, and writes docs/evidence/TOPIC.md: command, commit, date, machine, figure,
# target, met or not. Long: ./test.sh holds a small part of each. Steps that are done for this commit are not done again.
#   ./evidence.sh [TOPIC]     without TOPIC: all there are
set -euo pipefail
cd "$(dirname "$0")"
topics=(behaviour main-job simulator accuracy drivers tradeoff compare fresh-debian found-outside)

wanted=("${topics[@]}")
if (($#)); then
  wanted=("$1")
  if [[ " ${topics[*]} " != *" $1 "* ]]; then
    echo "evidence.sh: no topic '$1'; there is: ${topics[*]}" >&2
    exit 2
  fi
fi

cmake/setup.sh --evidence
cmake --preset release
cmake --build --preset release
for topic in "${wanted[@]}"; do "tests/evidence/$topic.sh"; done
