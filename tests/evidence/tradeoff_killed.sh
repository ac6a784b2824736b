#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A sweep that is killed (kill -9, the program and its workers) three times at random moments and gone on with, against one that
# nobody disturbed: errors.csv must be equal byte for byte.
#   tradeoff_killed.sh TWOCONE FOLDER ROBOT LEGS
# Leaves the undisturbed sweep in FOLDER/whole.
set -euo pipefail
twocone=$1 folder=$2 robot=$3 legs=$4
rm -rf "$folder"
mkdir -p "$folder"
sweep() { "$twocone" tradeoff --robot "$robot" --legs "$legs" --out "$folder/$1"; }
there() { find "$folder/killed/shards" -mindepth 1 -maxdepth 1 -name '[0-9]*' -type d 2>/dev/null | wc -l; }

begin=$SECONDS
sweep whole
whole=$((SECONDS - begin))
all=$("$twocone" tradeoff --robot "$robot" --legs "$legs" --shards)
echo "undisturbed: $all shards, $whole s"

RANDOM=6 # the moments are the same at each call
kills=0
before=0
for _ in 1 2 3; do
  # In a process group of its own; within a third of the time, so that something is left to be killed.
  setsid "$twocone" tradeoff --robot "$robot" --legs "$legs" --out "$folder/killed" >>"$folder/killed.log" 2>&1 &
  pid=$!
  moment=$(awk "BEGIN { print 1 + ($whole / 3.5 - 1) * $RANDOM / 32767 }")
  sleep "$moment"
  renderers=$(ps -e -o ppid=,comm= | awk '$2 == "povray"' | wc -l)
  if kill -9 -- "-$pid" 2>/dev/null; then kills=$((kills + 1)); fi
  wait "$pid" 2>/dev/null || true
  echo "killed after $moment s with $renderers POV-Rays at work: $(there) of $all shards are there"
  [ "$(there)" -ge "$before" ] || { echo "a finished shard got lost"; exit 1; }
  before=$(there)
done
[ $kills = 3 ] || { echo "only $kills of 3 were still at work when they were to be killed"; exit 1; }
[ "$before" -lt "$all" ] || { echo "nothing was left to go on with"; exit 1; }
# One shard less than all is an error that is told, not a result.
if "$twocone" tradeoff --robot "$robot" --legs "$legs" --out "$folder/killed" --merge >"$folder/merge.log" 2>&1; then
  echo "--merge took an incomplete sweep"
  exit 1
fi
echo "--merge: $(tail -n 1 "$folder/merge.log")"
sweep killed
cmp "$folder/whole/errors.csv" "$folder/killed/errors.csv"
echo "byte-equal: errors.csv of $(($(wc -l <"$folder/whole/errors.csv") - 1)) settings, $all shards, after 3 kills at $before of $all shards"
