#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Every wrong input gives one clear line on stderr and exit status 1 or 2. Prints these lines as a table.
#   wrong_input.sh TWOCONE SOURCE_DIR
. "$(dirname "$0")/common.sh"
lab=$work/lab
mkdir -p "$lab"
cp -r "$source_dir/scenes" "$lab/scenes"
mkdir "$lab/robots"
sed 's|\.\./\.\./\.\./scenes|../scenes|' "$source_dir/tests/end_to_end/data/small.yaml" >"$lab/robots/small.yaml"
cd "$lab" || exit 1

# expect NAME STATUS PATTERN COMMAND...
expect() {
  local name=$1 status=$2 pattern=$3
  shift 3
  timeout 100 "$@" >"$work/out" 2>"$work/err" </dev/null
  local got=$?
  sed -i '/^[0-9]* frames; POV-Ray takes some seconds for the first$/d' "$work/err" # this line is no error
  sed -i -E '/^[-0-9]+T[-+0-9:.]+ warning povray: /d' "$work/err" # a line of the log: a kernel without Landlock, for example
  local lines
  lines=$(wc -l <"$work/err")
  printf '%-34s exit %d  %s\n' "$name" "$got" "$(head -n 1 "$work/err" | sed "s|$work|...|g")"
  [ "$got" -eq "$status" ] || fail "$name: exit $got, wanted $status"
  [ "$lines" -eq 1 ] || fail "$name: $lines lines on stderr, wanted one: $(cat "$work/err")"
  grep -qE -- "$pattern" "$work/err" || fail "$name: the line does not match '$pattern'"
  [ -s "$work/out" ] && fail "$name: there is output on stdout"
}
run() { "$twocone" run --frames 1 --behaviour still --out "$work/run_$RANDOM$RANDOM" "$@"; }
export -f run
export twocone work

# variant FILE SED COPY: makes a copy of a file with one mistake.
variant() { sed "$2" "$1" >"$3"; cmp -s "$1" "$3" && fail "the variation '$2' of $1 changes nothing"; }
robot_with_map() { variant robots/small.yaml "s|lab.map.yaml|$1|" "robots/$2"; }
with_scene() { # SCENE NAME: makes a map and a robot file for a changed scene
  variant scenes/lab.map.yaml "s|^scene: lab.pov|scene: $1|" "scenes/$2.map.yaml"
  robot_with_map "$2.map.yaml" "$2.yaml"
}
with_map() { # SED NAME
  variant scenes/lab.map.yaml "$1" "scenes/$2.map.yaml"
  robot_with_map "$2.map.yaml" "$2.yaml"
}

expect 'no such robot file' 1 'nowhere.yaml' bash -c 'run --robot robots/nowhere.yaml'
with_scene nowhere.pov no_scene
expect 'no such scene' 1 'nowhere.pov' bash -c 'run --robot robots/no_scene.yaml'
variant scenes/lab.pov 's|//\*PMName robot|//*PMName cart|' scenes/no_robot.pov
with_scene no_robot.pov no_robot
expect 'scene without robot' 1 'no_robot.pov.*PMName robot' bash -c 'run --robot robots/no_robot.yaml'
variant scenes/lab.pov 's|//\*PMName upper|//*PMName lower|' scenes/two_lower.pov
with_scene two_lower.pov two_lower
expect 'scene with two cameras lower' 1 'two_lower.pov:[0-9]+.*lower' bash -c 'run --robot robots/two_lower.yaml'
variant scenes/lab.pov '0,/^light_source *{/s||light_source { bogus|' scenes/syntax.pov
with_scene syntax.pov syntax
expect 'scene with a syntax error' 1 'syntax.pov:[0-9]+: .*bogus' bash -c 'run --robot robots/syntax.yaml'
variant scenes/lab.pov '$s|$|\n#declare Broken = union {|' scenes/open_brace.pov
with_scene open_brace.pov open_brace
expect 'scene with an open brace' 1 'open_brace.pov:[0-9]+:[0-9]+' bash -c 'run --robot robots/open_brace.yaml'
with_map '/^bounds_m/d' no_bounds
expect 'map with a missing key' 1 'no_bounds.map.yaml:[0-9]+: bounds_m' bash -c 'run --robot robots/no_bounds.yaml'
with_map 's|^unit_m: 0.05|unit_m: five|' wrong_type
expect 'map with a wrong type' 1 'wrong_type.map.yaml:[0-9]+: unit_m is .five' bash -c 'run --robot robots/wrong_type.yaml'
with_map '0,/radius_m: 0.15/s||radius_m: -0.15|' negative
expect 'map with a negative radius' 1 'negative.map.yaml:[0-9]+: .*radius_m is -0.15 m' bash -c 'run --robot robots/negative.yaml'
variant robots/small.yaml 's|lower: {driver: sim_povray|lower: {driver: teleport|' robots/unknown.yaml
expect 'robot with an unknown driver' 1 'teleport' bash -c 'run --robot robots/unknown.yaml'
variant robots/small.yaml 's|lower: {driver: sim_povray|lower: {driver: v4l2_camera|' robots/nameless.yaml
expect 'real camera without a name' 1 'nameless.yaml:[0-9]+: cameras.lower.device is missing: .*twocone devices' bash -c 'run --robot robots/nameless.yaml'
variant robots/small.yaml 's|lower: {driver: sim_povray|lower: {driver: v4l2_camera, device: /dev/video0|' robots/mixed.yaml
expect 'real camera on a simulated robot' 1 'sim_povray moves all parts of a robot or none' bash -c 'run --robot robots/mixed.yaml'
variant robots/small.yaml 's|^latency_frames|latency_frame|' robots/typo.yaml
expect 'robot with a misspelt key' 1 'typo.yaml:[0-9]+: .*latency_frame' bash -c 'run --robot robots/typo.yaml'
expect '--set without a value' 1 '^twocone: --set body.radius_m: must be KEY=VALUE, such as' bash -c 'run --robot robots/small.yaml --set body.radius_m'
expect '--set of an unknown key' 1 '^twocone: --set body.raduis_m=0.3: body.raduis_m' bash -c 'run --robot robots/small.yaml --set body.raduis_m=0.3'
expect '--set with a wrong value' 1 '^twocone: --set body.radius_m=-0.3: body.radius_m is -0.3 m' bash -c 'run --robot robots/small.yaml --set body.radius_m=-0.3'
expect '--set below a value' 1 '^twocone: --set name.first=nina: name is not a section' bash -c 'run --robot robots/small.yaml --set name.first=nina'
expect '--set of look' 1 '^twocone: --set body.radius_m=wide: body.radius_m' "$twocone" look --robot robots/small.yaml --set body.radius_m=wide --out "$work/look_set"
sed '$s|$|\nestimator: {stage: fast}|' robots/small.yaml >robots/fast.yaml
expect 'robot with an unknown stage' 1 "fast.yaml:[0-9]+: estimator.stage is 'fast', must be found" bash -c 'run --robot robots/fast.yaml'
sed '$s|$|\nestimator: {landmarks: [red, green, grue]}|' robots/small.yaml >robots/grue.yaml
expect 'robot with an unknown landmark' 1 "grue.yaml: estimator.landmarks .*'grue'.*lab.map.yaml" bash -c 'run --robot robots/grue.yaml'

touch "$work/file"
expect 'output folder not to be made' 1 "$work/file" "$twocone" run --robot robots/small.yaml --frames 1 --out "$work/file/run"
expect 'report of no run' 1 'no run here' "$twocone" report "$lab"
expect 'no POV-Ray' 1 'POV-Ray is not installed.*apt install povray' env PATH="$work" "$twocone" run --robot robots/small.yaml --frames 1 --out "$work/run_no_povray"

expect 'no subcommand' 2 'subcommand' "$twocone"
expect 'calibrate of no run' 1 'no run here' "$twocone" calibrate "$lab" --out "$work/calibrated.yaml"
expect 'calibrate onto a file' 1 'file exists: --force' "$twocone" calibrate "$lab" --out "$work/file"
expect 'calibrate with unknown prior' 2 "no prior 'weight'; there are: apex_rad" "$twocone" calibrate "$lab" --out "$work/calibrated.yaml" --prior weight=1
expect 'calibrate with prior 0' 2 'tilt_rad is 0, must be > 0' "$twocone" calibrate "$lab" --out "$work/calibrated.yaml" --prior tilt_rad=0
# The file of numbers is named after the robot file, so that another calibration in the folder does not matter.
touch "$work/calibration.json" "$work/twice.calibration.json"
expect 'calibrate beside another' 1 'no run here' "$twocone" calibrate "$lab" --out "$work/once.yaml"
expect 'calibrate onto numbers' 1 'twice.calibration.json exists: --force' "$twocone" calibrate "$lab" --out "$work/twice.yaml"
import() { "$twocone" import --robot robots/small.yaml --lower "$work/cam0" --upper "$work/cam1" --out "$work/imported" "$@"; }
export -f import
mkdir "$work/cam0" "$work/cam1"
expect 'import of no images' 1 'cam0: no images here' bash -c 'import'
expect 'import of no folder' 1 'nowhere is no folder' "$twocone" import --robot robots/small.yaml --lower nowhere --upper "$work/cam1" --out "$work/imported"
touch "$work/cam0/frame_1.png" "$work/cam1/frame_1.png"
expect 'import, names that are no times' 1 "frame_1.png: the name is 'frame_1', must be the time, seconds with a decimal point" bash -c 'import'
echo '1.5 frame_1.png' >"$work/times.txt"
expect 'import, files that are no images' 1 'cam0: no image that can be read' bash -c 'import --lower-times "$work/times.txt"'
echo '15 frame_1.png' >"$work/times.txt"
expect 'import, times of no unit' 1 "times.txt:1: the time is '15', must be seconds with a decimal point" bash -c 'import --lower-times "$work/times.txt"'
expect 'import, times of unknown unit' 2 'times-in' bash -c 'import --times-in minutes'
expect 'import without images' 2 '--lower and --upper are required, or --recording' "$twocone" import --robot robots/small.yaml --out "$work/imported"
[ -e "$work/imported" ] && fail 'import: a folder was left behind'
expect 'look at no robot file' 1 'nowhere.yaml' "$twocone" look --robot robots/nowhere.yaml
expect 'look without robot' 2 'robot' "$twocone" look
expect 'look at a real robot' 1 'usb_camera.yaml: no part has driver sim_povray: .*twocone doctor' "$twocone" look --robot "$source_dir/robots/usb_camera.yaml" --out "$work/looked"
expect 'look with an unknown renderer' 2 'renderer: .*blender.*auto,native,povray' "$twocone" look --robot robots/small.yaml --renderer blender
mkdir "$work/seen"
touch "$work/seen/upper.png"
expect 'look onto an image' 1 'seen/upper.png exists: --force' "$twocone" look --robot robots/small.yaml --out "$work/seen"
expect 'look into no folder' 1 "$work/file" "$twocone" look --robot robots/small.yaml --out "$work/file/look"
expect 'look at no scene' 1 'nowhere.pov' "$twocone" look --robot robots/no_scene.yaml --out "$work/looked"
[ -e "$work/looked" ] && fail 'look: a folder was left behind'
expect 'doctor of no robot file' 1 'nowhere.yaml' "$twocone" doctor --robot robots/nowhere.yaml
expect 'doctor of a misspelt key' 1 'typo.yaml:[0-9]+: .*latency_frame' "$twocone" doctor --robot robots/typo.yaml
expect 'doctor without robot' 2 'robot' "$twocone" doctor
expect 'doctor with unknown option' 2 'bogus' "$twocone" doctor --robot robots/small.yaml --bogus
expect 'doctor for no time' 2 'seconds' "$twocone" doctor --robot robots/small.yaml --seconds 0
expect 'doctor with an unknown log level' 2 'log-level: .*loud.*trace,debug,info,warning,error,off' "$twocone" doctor --robot robots/small.yaml --log-level loud
expect 'devices with unknown option' 2 'bogus' "$twocone" devices --bogus
expect 'devices with a name' 2 'camera' "$twocone" devices camera
expect 'tradeoff of no robot file' 1 'nowhere.yaml' "$twocone" tradeoff --robot robots/nowhere.yaml
expect 'tradeoff of a real robot' 1 'usb_camera.yaml' "$twocone" tradeoff --robot "$source_dir/robots/usb_camera.yaml"
expect 'tradeoff with two requirements' 2 'target-mm excludes --budget-ms' "$twocone" tradeoff --robot robots/small.yaml --target-mm 5 --budget-ms 20
expect 'tradeoff for a target of 0 mm' 2 'target-mm is 0, must be a number > 0' "$twocone" tradeoff --robot robots/small.yaml --target-mm 0
expect 'tradeoff for a target nan' 2 'target-mm is nan' "$twocone" tradeoff --robot robots/small.yaml --target-mm nan
expect 'tradeoff, no requirement' 2 'write-robot needs' "$twocone" tradeoff --robot robots/small.yaml --write-robot "$work/chosen.yaml"
expect 'tradeoff onto its own robot' 1 'is the robot that is swept' "$twocone" tradeoff --robot robots/small.yaml --target-mm 5 --write-robot robots/small.yaml
expect 'tradeoff with the jobs of before' 2 "unknown option '--jobs': start a process with --shard K" "$twocone" tradeoff --robot robots/small.yaml --jobs 2
expect 'tradeoff with too few episodes' 2 'episodes: Value 2 not in range' "$twocone" tradeoff --robot robots/small.yaml --episodes 2
expect 'tradeoff, a missing shard' 2 "shard is 100000, this sweep's are 0 to [0-9]+" "$twocone" tradeoff --robot robots/small.yaml --shard 100000
expect 'tradeoff, merge of no folder' 1 'nothing to merge' "$twocone" tradeoff --robot robots/small.yaml --out "$work/nowhere" --merge
compare() { "$twocone" compare --out "$work/comparison" "$@"; }
export -f compare
mkdir "$lab/none"
sed '/^scene:/d' scenes/lab.map.yaml >scenes/sceneless.map.yaml
expect 'compare of nothing' 2 'RUN is required' "$twocone" compare
expect 'compare of one run' 2 '1 run folder given: it takes a simulated and a real one' bash -c 'compare none'
expect 'compare of three runs' 2 'RUN: At Most 2' bash -c 'compare none none none'
expect 'compare of two runs and a scene' 2 '--scene .*give one run folder' bash -c 'compare none none --scene scenes/lab.map.yaml'
expect 'compare of no run' 1 'none: no run here' bash -c 'compare none none'
expect 'compare of no folder' 1 'nowhere: no run here' bash -c 'compare nowhere none'
expect 'compare of no run, with a scene' 1 'none: no run here' bash -c 'compare none --scene scenes/lab.map.yaml'
expect 'compare with a map without scene' 1 'sceneless.map.yaml' bash -c 'compare none --scene scenes/sceneless.map.yaml'
expect 'compare with a limit below 0' 2 'max-range-mm is -1, must be a number >= 0' bash -c 'compare none none --max-range-mm -1'
expect 'compare with a limit nan' 2 'max-range-mm is nan' bash -c 'compare none none --max-range-mm nan'
expect 'compare without false alarms' 2 'false-alarm is 0, must be above 0 and below 1' bash -c 'compare none none --false-alarm 0'
expect 'compare onto a robot file' 1 'small.yaml exists: --force replaces it' bash -c 'compare none none --write-robot robots/small.yaml'
expect 'compare with too few frames' 2 'frames: Value 3 not in range' bash -c 'compare none none --frames 3'
[ -e "$work/comparison" ] && fail 'compare: a folder was left behind'
expect 'compare onto a file' 1 'cannot make .*file' "$twocone" compare none none --out "$work/file"
expect 'new of nothing' 2 'SCENE is required' "$twocone" new --out "$work/new"
expect 'new without a folder' 2 'out is required' "$twocone" new scenes/lab.pov
expect 'new of no scene' 1 'nowhere.pov: no such scene file' "$twocone" new scenes/nowhere.pov --out "$work/new"
expect 'new of a scene with an open brace' 1 'open_brace.pov:[0-9]+:[0-9]+' "$twocone" new scenes/open_brace.pov --out "$work/new"
echo 'sphere { 0, 1 } camera { location -5*z look_at 0 }' >scenes/no_floor.pov
expect 'new of a scene without floor' 1 'no_floor.pov: no floor was found' "$twocone" new scenes/no_floor.pov --out "$work/new"
expect 'new of a scene without room' 1 'has no room for a robot of 0.2 m radius' "$twocone" new scenes/lab.pov --unit-m 0.001 --out "$work/new"
expect 'new with a unit of 0' 2 "unit-m: '0' must be a number" "$twocone" new scenes/lab.pov --unit-m 0 --out "$work/new"
expect 'new onto the scene itself' 1 'the wrapper would replace the scene' "$twocone" new scenes/lab.pov --out scenes
[ -e "$work/new" ] && fail 'new: a folder was left behind'
mkdir "$work/new" && touch "$work/new/lab.yaml"
expect 'new onto a robot file' 1 'lab.yaml exists: --force replaces it' "$twocone" new scenes/lab.pov --out "$work/new"
expect 'unknown subcommand' 2 "no subcommand 'dance'; there are: run, localise, report, view, serve, effects" "$twocone" dance
expect 'unknown option' 2 'bogus' "$twocone" run --robot robots/small.yaml --bogus
expect 'misspelt option' 2 "unknown option '--frame', did you mean --frames\\? \\(see twocone run --help\\)" "$twocone" run --robot robots/small.yaml --frame 3
expect 'unexpected words' 2 "nothing is expected at 'one' 'two' 'three'" "$twocone" run --robot robots/small.yaml one two three
expect 'misspelt subcommand' 2 "no subcommand 'calibrat', did you mean calibrate\\?" "$twocone" calibrat
expect 'negative seed' 2 "seed: '-1' must be a whole number from 0 to 18446744073709551615" "$twocone" run --robot robots/small.yaml --seed -1
expect 'seed that is too large' 2 "seed: '9{23}' must be a whole number" "$twocone" tradeoff --robot robots/small.yaml --seed 99999999999999999999999
expect 'patience that is no number' 2 "patience: 'nan' must be a number from 0" "$twocone" run --robot robots/small.yaml --patience nan
expect 'a map for a robot file' 1 'lab.map.yaml: is a map; a robot file is wanted' bash -c 'run --robot scenes/lab.map.yaml'
expect 'a robot file for a map' 1 'small.yaml: is a robot file; a map is wanted' "$twocone" serve --scene robots/small.yaml
printf 'name: tab\n\tmap: x\n' >robots/tab.yaml
expect 'robot file indented by a tab' 1 'tab.yaml:2: the line is indented by a tab' bash -c 'run --robot robots/tab.yaml'
expect 'no robot' 2 'robot' "$twocone" run
expect 'neither robot nor run' 2 'robot is required, or --resume' "$twocone" run
expect 'resume of no run' 1 'no run here' "$twocone" run --resume "$lab"
expect 'resume with another option' 2 'resume excludes --seed' "$twocone" run --resume "$lab" --seed 3
expect 'localise with --force alone' 2 'force needs --out' "$twocone" localise "$lab" --force
expect 'run onto another folder' 1 'does not replace .*: it is no run of twocone' "$twocone" run --robot robots/small.yaml --frames 1 --out "$lab/robots" --force
ln -s "$lab/robots" "$work/link"
expect 'run onto a link' 1 'does not replace .*: it is a link' "$twocone" run --robot robots/small.yaml --frames 1 --out "$work/link/" --force
expect 'run onto the working folder' 1 'does not replace [.]: ' "$twocone" run --robot robots/small.yaml --frames 1 --out . --force
[ -e robots/small.yaml ] || fail '--force has removed a folder that is no run'
variant robots/small.yaml 's|^name: small|name: ../../small|' robots/elsewhere.yaml
expect 'robot with a path for a name' 1 "name is '../../small', must be fit for a folder" "$twocone" run --robot robots/elsewhere.yaml
expect 'frames that are no number' 2 'frames' "$twocone" run --robot robots/small.yaml --frames many
expect 'no frames' 2 'frames' "$twocone" run --robot robots/small.yaml --frames 0
expect 'unknown method' 2 'method' "$twocone" run --robot robots/small.yaml --method magic
expect 'time budget of 0 ms' 2 '--budget-ms: the time budget is 0 ms, must be > 0 ms' "$twocone" run --robot robots/small.yaml --budget-ms 0
expect 'time budget of method paper' 2 '--budget-ms: method paper has no stages' "$twocone" run --robot robots/small.yaml --method paper --budget-ms 20
expect 'driving by hand without a page' 2 'behaviour manual needs --live' "$twocone" run --robot robots/small.yaml --behaviour manual
expect 'a port that is none' 2 "'99999' is no port" "$twocone" run --robot robots/small.yaml --live 99999
expect 'an address by name' 2 'live-address' "$twocone" run --robot robots/small.yaml --live --live-address localhost
expect 'a page at an address of another machine' 1 '192.0.2.1:0: ' "$twocone" run --robot robots/small.yaml --live --live-address 192.0.2.1 --frames 1
expect 'a view of no run' 1 'no run here, and none in the folders below it' "$twocone" view "$lab/robots"
expect 'unknown behaviour' 2 'behaviour' "$twocone" run --robot robots/small.yaml --behaviour dance

# A full disk: a file system of 1 MiB in a separate mount namespace.
flags=$([ "$(id -u)" -eq 0 ] && echo -m || echo -rm)
if unshare "$flags" true 2>"$work/err"; then
  mkdir "$work/full"
  expect 'disk full' 1 'cannot write .*No space left on device' unshare "$flags" bash -c \
    'mount -t tmpfs -o size=1m tmpfs "$1/full" && exec "$2" run --robot robots/small.yaml --frames 40 --out "$1/full/run"' _ "$work" "$twocone"
else
  skip "a full disk was not tested: no mount namespace is available here ($(cat "$work/err"))"
fi
finish
