#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compares the results of the program with those recorded before the code was reorganised: tables, JSON, robot files and
# pixels of all main uses, by their hashes (behaviour/hashes.sh, behaviour/recorded.txt, behaviour/renamed.txt).
also=(tests/evidence/behaviour)
. "$(dirname "$0")/common.sh"
recorded=tests/evidence/behaviour/recorded.txt
step hashes tests/evidence/behaviour/hashes.sh "$twocone" "$PWD" "$work/runs"
rm -rf "$work/runs"
differences=$(diff <(grep -v '^#' "$recorded") <(LC_ALL=C sort -k2 "$work/hashes.log") | sed -n 's/^[<>] [0-9a-f]*  //p' | sort -u || true)
results=$(wc -l <"$work/hashes.log")
row "results equal to the recorded ones" "$((results - $(grep -c . <<<"$differences" || true))) of $results" "all" \
  "$([ -z "$differences" ] && [ "$results" = "$(grep -vc '^#' "$recorded")" ] && echo yes || echo no)"
[ -z "$differences" ] || block "results that differ" "$differences"
block "names changed since (new, old)" "$(grep -v '^#' tests/evidence/behaviour/renamed.txt)"
page "the same results as before the code was reorganised"
