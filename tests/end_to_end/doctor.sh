#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Calls `twocone doctor` and `twocone devices` without devices, and checks table, last line and exit status.
#   doctor.sh TWOCONE SOURCE_DIR
. "$(dirname "$0")/common.sh"

# call NAME STATUS COMMAND...: checks the exit status and writes the standard output to $work/out.
call() {
  local name=$1 status=$2
  shift 2
  timeout 100 "$@" >"$work/out" 2>"$work/err" </dev/null
  local got=$?
  echo "$name: exit $got; $(tail -n 1 "$work/out")"
  [ "$got" -eq "$status" ] || fail "$name: exit $got, wanted $status: $(cat "$work/out" "$work/err")"
}
row() { grep -qE "$1" "$work/out" || fail "no row matches '$1': $(cat "$work/out")"; }
last() { tail -n 1 "$work/out" | grep -qE "$1" || fail "the last line does not match '$1': $(tail -n 1 "$work/out")"; }

call 'devices' 0 "$twocone" devices
[ -s "$work/out" ] || fail "devices prints nothing"
# libcamera's own warnings and errors must not appear, unless a user requests them.
[ ! -s "$work/err" ] || fail "devices prints errors: $(cat "$work/err")"

call 'simulated' 0 "$twocone" doctor --robot "$source_dir/tests/end_to_end/data/small.yaml"
row '^drive +driver +sim_povray: simulated, no bench test +ok$'
row '^lower +mirror .* ok$'
row '^upper +focus .* ok$'
last '^all [0-9]+ checks ok$'

# The images contradict this rig.
sed "s|rim_radius_px: 59.0|rim_radius_px: 53.0|; s|\.\./\.\./\.\./scenes|$source_dir/scenes|" \
  "$source_dir/tests/end_to_end/data/small.yaml" >"$work/off.yaml"
call 'rig off' 1 "$twocone" doctor --robot "$work/off.yaml"
row '^lower +mirror .* failed +rig: lower:'
last '^[0-9]+ ok, 0 warnings, 2 failed, 0 not run$'

# Without any device, there is one row for each part and no question about the wheels.
sed "s|\.\./\.\./\.\./scenes|$source_dir/scenes|; /^start:/d; /^effects:/d
     s|{driver: sim_povray, wheel|{driver: serial_diffdrive, port: /dev/no_port, protocol: roboclaw, counts_per_turn: 1000, wheel|
     s|lower: {driver: sim_povray|lower: {driver: v4l2_camera, device: /dev/no_camera|
     s|upper: {driver: sim_povray|upper: {driver: v4l2_camera, device: /dev/no_other_camera|" \
  "$source_dir/tests/end_to_end/data/small.yaml" >"$work/unplugged.yaml"
call 'unplugged' 1 "$twocone" doctor --robot "$work/unplugged.yaml" --wheels-off-the-ground
row '^lower +opens +.* failed '
row '^upper +opens +.* failed '
row '^pair +stream .* not run '
row '^drive +opens +.* failed '
row '^rig +blind zones +both mirrors range from .* ok$'
last '^2 ok, 0 warnings, 3 failed, 1 not run$'
[ "$(wc -l <"$work/err")" -eq 1 ] || fail "not one line on stderr: $(cat "$work/err")"

# One camera for both entries is found in the file, before any device is opened twice.
sed "s|no_other_camera|no_camera|" "$work/unplugged.yaml" >"$work/one_camera.yaml"
call 'one camera' 1 "$twocone" doctor --robot "$work/one_camera.yaml"
row '^cameras +two devices +.* failed +give each its own device:'
finish
