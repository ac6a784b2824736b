#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests the command line apart from wrong input: help, output that cannot be written, a terminal that is closed, and the
# equality of two equal runs.
#   command_line.sh TWOCONE SOURCE_DIR
. "$(dirname "$0")/common.sh"
small=$source_dir/tests/end_to_end/data/small.yaml

# gives NAME STATUS PATTERN COMMAND...: checks the exit status, and the pattern in stdout and stderr together
gives() {
  local name=$1 status=$2 pattern=$3 got=0
  shift 3
  timeout 100 "$@" >"$work/said" 2>&1 </dev/null || got=$?
  printf '%-34s exit %d  %s\n' "$name" "$got" "$(head -n 1 "$work/said" | sed "s|$work|...|g")"
  [ "$got" -eq "$status" ] || fail "$name: exit $got, wanted $status: $(cat "$work/said")"
  grep -qE -- "$pattern" "$work/said" || fail "$name: nothing matches '$pattern': $(cat "$work/said")"
}

# ---- help
gives 'help' 0 '^Usage: twocone \[OPTIONS\] SUBCOMMAND' "$twocone" help
gives 'help of a command' 0 '^Usage: twocone compare \[OPTIONS\] RUN \[RUN\]$' "$twocone" help compare
gives 'help of no command' 2 "no subcommand 'localize', did you mean localise\?" "$twocone" help localize
for command in run localise report serve effects new as-built design scan print-bands look calibrate survey import devices doctor tradeoff compare; do
  "$twocone" help "$command" >"$work/help" || fail "help $command: exit $?"
  "$twocone" "$command" --help | cmp -s - "$work/help" || fail "help $command is not what $command --help prints"
done

# ---- look: where robot file, map and scene disagree is on standard output, and the exit status says whether they do
gives 'look' 0 'wrote +.*look/above.svg$' "$twocone" look --robot "$small" --out "$work/look"
gives 'look again' 1 'look/lower.png exists: --force' "$twocone" look --robot "$small" --out "$work/look"
gives 'look at a start that touches' 1 '^ +1 .*start \(-2.200, -0.300\) is 0.[0-9]+ m from landmark red \(.*lab.map.yaml:14\)' \
  "$twocone" look --robot "$small" --set start.x_m=-2.2 --set start.y_m=-0.3 --out "$work/look" --force

# ---- print-bands: pages, and the lines of the map
gives 'print-bands' 0 'bands: 7, x_m: \?, y_m: \?, radius_m: 0.055, line_m: \?' "$twocone" print-bands 7 12 --radius-m 0.055 --out "$work/bands.html"
[ "$(grep -c '<svg' "$work/bands.html")" -eq 6 ] || fail 'print-bands: not 3 pages for each of 2 numbers'
gives 'print-bands again' 1 'bands.html exists: --force' "$twocone" print-bands 7 --out "$work/bands.html"
gives 'print-bands of no number' 2 'print-bands 65: must be 1 to 64' "$twocone" print-bands 65 --out "$work/none.html"
gives 'print-bands of huge cells' 2 '--cell-m 0.5: must be at most' "$twocone" print-bands 7 --cell-m 0.5 --out "$work/none.html"

# ---- output that cannot be written
gives 'help onto a full disk' 1 'cannot write to standard output: No space left' bash -c '"$1" help >/dev/full' _ "$twocone"
gives 'help onto nothing' 1 'cannot write to standard output' bash -c '"$1" help >&-' _ "$twocone"
gives 'run onto a full disk' 1 'cannot write to standard output: No space left' \
  bash -c '"$1" run --robot "$2" --frames 4 --behaviour still --seed 7 --out "$3/full" >/dev/full' _ "$twocone" "$small" "$work"
[ "$(wc -l <"$work/full/ranges.csv")" -gt 12 ] || fail 'run onto a full disk: its folder lacks tables'
# Standard output and error are closed: no file of the run may take their numbers.
bash -c '"$1" run --robot "$2" --frames 4 --behaviour still --seed 7 --out "$3/closed" >&- 2>&- <&-' _ "$twocone" "$small" "$work"
[ $? -eq 1 ] || fail 'run onto nothing: exit status is not 1'

# ---- two equal runs differ only in measured times
for run in full closed; do
  cp -r "$work/$run" "$work/$run.timeless"
  find "$work/$run.timeless" \( -name timing.csv -o -name run.log \) -delete
  sed -i 's/,[^,]*$//' "$work/$run.timeless/frames.csv"
  find "$work/$run.timeless" \( -name run.yaml -o -name summary.json \) -exec sed -i -E '/(wall_s|render_wait_s|own_cpu_s|render_cpu_s)"?:/d' {} +
done
diff -r "$work/full.timeless" "$work/closed.timeless" >"$work/differences" || fail "equal runs differ: $(head "$work/differences")"

# ---- the log: in the run folder alone, and on standard error where it is asked for
[ -f "$work/full/run.log" ] || fail 'a run without its run.log'
gives 'run with its log' 0 ' info run: 2 frames, behaviour still' "$twocone" run --robot "$small" --frames 2 --behaviour still --set rig.lens_height_m=0.26 --out "$work/logged" --log-level info
grep -q ' info run: 2 frames, behaviour still' "$work/logged/run.log" || fail "run.log lacks what was shown: $(cat "$work/logged/run.log")"
# The rig of that run is not that of its file.
gives 'calibrate of a run with --set' 1 'logged has 2 frames, a calibration needs' "$twocone" calibrate "$work/logged" --out "$work/calibrated.yaml"

# ---- docs/running.md shows each kind of line that a run prints
"$twocone" localise "$work/full" >"$work/table" 2>&1 || fail "localise: $(cat "$work/table")"
grep -oE '^[A-Z][A-Za-z -]+' "$work/table" | sort -u | while read -r label; do
  grep -qF -- "$label" "$source_dir/docs/running.md" || echo "$label"
done >"$work/labels"
[ -s "$work/labels" ] && fail "docs/running.md does not show these lines of a run's table: $(cat "$work/labels")"
[ "$(grep -cE '^[A-Z]' "$work/table")" -gt 5 ] || fail "the table has too few lines: $(cat "$work/table")"

# ---- files of another room
sed "s|^map: .*|map: $source_dir/scenes/hall.map.yaml|" "$small" >"$work/elsewhere.yaml"
gives 'localise by another room' 1 'hall.map.yaml has the landmarks .* name it with --map' \
  "$twocone" localise "$work/full" --robot "$work/elsewhere.yaml" --out "$work/localised"
[ -e "$work/localised" ] && fail 'localise by another room: a folder was left behind'
gives 'localise by another map, in place' 2 'map requires .*out' "$twocone" localise "$work/full" --map "$source_dir/scenes/lab.map.yaml"
gives 'localise with nothing else' 2 'out needs --robot or --map' "$twocone" localise "$work/full" --out "$work/localised"
"$twocone" run --robot "$source_dir/robots/hall_sim.yaml" --frames 4 --behaviour still --out "$work/hall" >"$work/said" 2>&1 ||
  fail "a run in the hall: $(cat "$work/said")"
# A map that is off by a decimetre along x moves all places by as much.
awk -v scenes="$source_dir/scenes/" '
  /\{name:/ { match($0, /x_m: +-?[0-9.]+/); x_m = substr($0, RSTART + 4, RLENGTH - 4) + 0.1
    $0 = substr($0, 1, RSTART - 1) "x_m: " x_m substr($0, RSTART + RLENGTH) }
  { sub(/^scene: /, "&" scenes) } 1' "$source_dir/scenes/hall.map.yaml" >"$work/moved.map.yaml"
gives 'localise by another map' 0 '^Position' "$twocone" localise "$work/hall" --map "$work/moved.map.yaml" --out "$work/moved"
paste -d, "$work/hall/fixes.csv" "$work/moved/fixes.csv" | awk -F, 'NR == 1 { n = NF / 2 } NR > 1 && $3 == "ok" { ++fixes; off = $(n + 4) - $4 - 0.1
  if (off * off > 1e-12) ++wrong } END { exit !fixes || wrong }' || fail "localise by another map: $(cat "$work/moved/fixes.csv")"
gives 'compare of two rooms' 1 'lab.map.yaml.* and .*hall.map.yaml.* are not of one room' \
  "$twocone" compare "$work/full" "$work/hall" --out "$work/comparison"
gives 'compare with another room' 1 'hall.map.yaml is not of the room of .*lab.map.yaml' \
  "$twocone" compare "$work/full" --scene "$source_dir/scenes/hall.map.yaml" --out "$work/rendered"

# ---- a row that so few frames cannot decide
gives 'compare, an undecided row' 3 'twocone: undecided: timing, lower frames lost: 0 \+- [0-9.]+ %, limit 1' \
  "$twocone" compare "$work/full" "$work/closed" --no-page --max-lost-percent 1 --out "$work/undecided"
grep -qE 'lower frames lost, % +0.000 +0.000 +[0-9.]+ +1 cannot tell$' "$work/said" || fail "compare: no sigma beside it: $(cat "$work/said")"

# ---- a terminal that is closed
# hang_up FOLDER COMMAND...: sends SIGHUP after the first finished frame, and sets $status to the exit status
hang_up() {
  local folder=$1
  shift
  "$@" >"$work/said" 2>&1 &
  local pid=$!
  for _ in $(seq 600); do [ "$(cat "$folder/frames.csv" 2>/dev/null | wc -l)" -ge 2 ] && break; sleep 0.1; done
  kill -HUP "$pid"
  for _ in $(seq 300); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
  kill -0 "$pid" 2>/dev/null && { fail "hang-up: the program did not end within 30 s"; kill -9 "$pid"; }
  wait "$pid"
  status=$?
}
# The caller of this script may ignore the signal, and programs inherit that.
hang_up "$work/hung" env --default-signal=HUP "$twocone" run --robot "$small" --frames 100000 --behaviour still --out "$work/hung"
[ "$status" -ne 0 ] || fail 'hang-up: exit status 0'
# A program that the signal itself ends prints no last line.
grep -q 'twocone: .*[0-9] frames' "$work/said" || fail "hang-up: the run did not end in good order: $(cat "$work/said")"
hang_up "$work/nohup" nohup "$twocone" run --robot "$small" --frames 30 --behaviour still --out "$work/nohup"
[ "$status" -eq 0 ] || fail "hang-up, ignored: exit $status: $(cat "$work/said")"
grep -q '30 of 30 frames' "$work/said" || fail "hang-up, ignored: the run was cut off: $(cat "$work/said")"
finish
