#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Measures the claims of the project in full length and writes docs/evidence/TOPIC.md: command, commit, date, machine, figure,
# target, met or not. This takes long; ./test.sh runs a small part of each. Steps that are done for this commit are not repeated.
#   ./evidence.sh --stale     lists the pages whose sources have changed since they were written, and does nothing
#   ./evidence.sh [TOPIC]     without TOPIC: all topics
set -euo pipefail
cd "$(dirname "$0")"
topics=(behaviour dense design code-lines checks toy-camera public-interface python recordings release main-job simulator renderer accuracy first-day survey mapping bands drivers viewer tradeoff compare fresh-debian found-outside)

# The value in a row of a page's first table.
value_of() { sed -n "s/^| $2 | \(.*\) |\$/\1/p" "$1" | head -n 1; }
if [ "${1:-}" = --stale ]; then
  stale=0
  for page in docs/evidence/*.md; do
    read -ra sources <<<"$(value_of "$page" sources)"
    now="" # a page of before pages named their sources
    if ((${#sources[@]})); then now=$(git ls-tree HEAD -- "${sources[@]}" | sha1sum | cut -c1-10); fi
    if [ -z "$now" ] || [ "$now" != "$(value_of "$page" "their state")" ]; then
      echo "stale: $page, measured on commit $(value_of "$page" "commit measured")"
      stale=$((stale + 1))
    fi
  done
  echo "$stale of $(ls docs/evidence/*.md | wc -l) pages are stale"
  exit
fi

wanted=("${topics[@]}")
if (($#)); then
  wanted=("$1")
  if [[ " ${topics[*]} " != *" $1 "* ]]; then
    echo "evidence.sh: no topic '$1'; topics: ${topics[*]}" >&2
    exit 2
  fi
fi

cmake/setup.sh --evidence
cmake --preset release
cmake --build --preset release
for topic in "${wanted[@]}"; do "tests/evidence/$topic.sh"; done
