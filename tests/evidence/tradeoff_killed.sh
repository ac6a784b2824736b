#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compares a sweep that is killed (kill -9, the program and its POV-Ray processes) three times at random times and resumed with an undisturbed
# one: errors.csv must be byte-equal.
#   tradeoff_killed.sh TWOCONE FOLDER ROBOT EPISODES
# The undisturbed sweep remains in FOLDER/whole.
set -euo pipefail
twocone=$1 folder=$2 robot=$3 episodes=$4
rm -rf "$folder"
mkdir -p "$folder"
sweep() { "$twocone" tradeoff --robot "$robot" --episodes "$episodes" --out "$folder/$1"; }
finished() { find "$folder/killed/shards" -mindepth 1 -maxdepth 1 -name '[0-9]*' -type d 2>/dev/null | wc -l; }

begin=$SECONDS
sweep whole
whole=$((SECONDS - begin))
all=$("$twocone" tradeoff --robot "$robot" --episodes "$episodes" --shards)
echo "undisturbed: $all shards, $whole s"

RANDOM=6 # the times are the same in each call
kills=0
before=0
for _ in 1 2 3; do
  # The sweep has its own process group. It is killed within a third of the time, so that shards remain for the next kill.
  setsid "$twocone" tradeoff --robot "$robot" --episodes "$episodes" --out "$folder/killed" >>"$folder/killed.log" 2>&1 &
  pid=$!
  moment=$(awk "BEGIN { print 1 + ($whole / 3.5 - 1) * $RANDOM / 32767 }")
  sleep "$moment"
  renderers=$(ps -e -o ppid=,comm= | awk '$2 == "povray"' | wc -l)
  if kill -9 -- "-$pid" 2>/dev/null; then kills=$((kills + 1)); fi
  wait "$pid" 2>/dev/null || true
  echo "killed after $moment s with $renderers POV-Ray processes running: $(finished) of $all shards are finished"
  [ "$(finished)" -ge "$before" ] || { echo "a finished shard is lost"; exit 1; }
  before=$(finished)
done
[ $kills = 3 ] || { echo "only $kills of 3 sweeps still ran at the time of their kill"; exit 1; }
[ "$before" -lt "$all" ] || { echo "no shard remained for the last call"; exit 1; }
# A missing shard must be a reported error.
if "$twocone" tradeoff --robot "$robot" --episodes "$episodes" --out "$folder/killed" --merge >"$folder/merge.log" 2>&1; then
  echo "--merge accepted an incomplete sweep"
  exit 1
fi
echo "--merge: $(tail -n 1 "$folder/merge.log")"
sweep killed
cmp "$folder/whole/errors.csv" "$folder/killed/errors.csv"
echo "byte-equal: errors.csv of $(($(wc -l <"$folder/whole/errors.csv") - 1)) settings, $all shards, after 3 kills at $before of $all shards"
