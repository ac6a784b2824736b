#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Kills a run (kill -9) after half of its frames. The written part must be readable, and no POV-Ray process may remain.
#   kill.sh TWOCONE SOURCE_DIR [ROBOT FRAMES]
. "$(dirname "$0")/common.sh"
robot=${3:-$source_dir/tests/end_to_end/data/small.yaml}
frames=${4:-40}

"$twocone" run --renderer povray --robot "$robot" --frames "$frames" --out "$work/run" >/dev/null 2>&1 &
pid=$!
for _ in $(seq 6000); do
  rows=$(cat "$work/run/frames.csv" 2>/dev/null | wc -l)
  ((rows > frames / 2)) && break
  sleep 0.1
done
povrays=$(pgrep -P "$pid" -d ' ' || true)
kill -9 "$pid"
wait "$pid" 2>/dev/null
[ -n "$povrays" ] || fail "no POV-Ray process was running when the program was killed, so this test shows nothing"
for _ in $(seq 50); do
  alive=""
  for p in $povrays; do
    # A zombie counts as dead: only its new parent has not reaped it yet.
    grep -qs '^State:.[^ZX]' "/proc/$p/status" && alive="$alive $p"
  done
  [ -z "$alive" ] && break
  sleep 0.1
done
[ -z "$alive" ] || fail "POV-Ray processes still exist after 5 s:$alive"

whole=$(($(wc -l <"$work/run/frames.csv") - 1))
echo "killed with $whole of $frames frames written"
((whole >= frames / 2)) || fail "only $whole frames in frames.csv"
for ((i = 0; i < whole; i++)); do
  name=$(printf '%06d.png' "$i")
  for view in lower upper; do [ -s "$work/run/$view/$name" ] || fail "$view/$name of a finished frame is missing"; done
done
# This is the state after a crash in the middle of a line.
printf '%d,1.2' "$whole" >>"$work/run/frames.csv"

"$twocone" report "$work/run" >"$work/table" 2>"$work/errors" || fail "report: $(cat "$work/errors")"
grep -q "$whole" "$work/table" || fail "the table does not report $whole frames: $(head -n 12 "$work/table")"
[ -s "$work/run/report.html" ] || fail "no report.html"
"$twocone" localise "$work/run" >/dev/null 2>"$work/errors" || fail "localise: $(cat "$work/errors")"
finish
