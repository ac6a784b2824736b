#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes a copy of the lab whose rig differs from the `rig:` of its robot. Calibration and comparison must find the differences.
#
#   tests/evidence/plant.sh FOLDER ERROR[=AMOUNT]...
#
# ERROR is one or several of: centre rim tilt offset apex wheel_radius; or all (these six); or none; and the errors of cameras:
# noise gain skew lost. AMOUNT, with its default: tilt (degrees, 0.5), wheel_radius (per cent, 1), noise (grey levels at a linear light
# of 0.2, 4), gain (1.2), skew (ms by which the upper camera's stamps are late, 8) and lost (per cent of the frames of each camera, 2).
# RATE_HZ: rate of both cameras, if it differs from the lab's. Files in FOLDER:
#   lab.pov, lab.map.yaml   the lab with the errors in the scene: in cameras and mirrors, never in `rig:`
#   robot.yaml              the lab's robot as it ships, so that its `rig:` and `drive:` are wrong. The errors of wheels and
#                           cameras are in `effects:`, which belongs to the simulated world
#   perfect.yaml            the same robot with the true `rig:` and `drive:`
#   truth.json              every true number of the rig and of the wheels, by its name in calibration.json
#
# Each error is an exact change of a text that must occur exactly once in the lab's scene; otherwise this script fails.
# World (x, y, z) is POV-Ray's <x, z, y> / 0.05. With y and z exchanged, a turn about body x or y by an angle is POV-Ray's
# `rotate` about x or z by minus that angle.
set -euo pipefail
cd "$(dirname "$0")/../.."

if (($# < 2)); then
  echo "usage: $0 FOLDER ERROR[=AMOUNT]...   (centre rim tilt offset apex wheel_radius, all, none; noise gain skew lost)" >&2
  exit 2
fi
folder=$1
shift
known=(centre rim tilt offset apex wheel_radius)
camera_errors=(noise gain skew lost)
declare -A planted=()
declare -A amount=([tilt]=0.5 [wheel_radius]=1 [noise]=4 [gain]=1.2 [skew]=8 [lost]=2)
for argument in "$@"; do
  error=${argument%%=*}
  if [ "$argument" != "$error" ]; then
    if [ -z "${amount[$error]:-}" ]; then
      echo "plant.sh: '$error' takes no amount; these do: ${!amount[*]}" >&2
      exit 2
    fi
    amount[$error]=${argument#*=}
  fi
  case $error in
    all) for name in "${known[@]}"; do planted[$name]=1; done ;;
    none) ;;
    *)
      if [[ " ${known[*]} ${camera_errors[*]} " != *" $error "* ]]; then
        echo "plant.sh: no error '$error'; there is: ${known[*]}, all, none, ${camera_errors[*]}" >&2
        exit 2
      fi
      planted[$error]=1
      ;;
  esac
done
is() { [ -n "${planted[$1]:-}" ]; }
calc() { awk "BEGIN { pi = atan2(0, -1); printf \"%.${2:-12}g\", $1 }"; }

mkdir -p "$folder"
scene=$folder/lab.pov
robot=$folder/robot.yaml
perfect=$folder/perfect.yaml
cp scenes/lab.pov "$scene"
cp scenes/lab.map.yaml "$folder/lab.map.yaml"
cp robots/lab_sim.yaml "$robot"

# change FILE OLD NEW: replaces OLD, which must occur exactly once. OLD is no pattern: awk's index() searches for the text itself.
change() {
  OLD=$2 NEW=$3 FROM=${1##*/} awk '
    { text = text $0 "\n" }
    END {
      at = index(text, ENVIRON["OLD"])
      if (at == 0 || index(substr(text, at + 1), ENVIRON["OLD"]) != 0) {
        print "plant.sh: must occur exactly once in the original of " ENVIRON["FROM"] ": " ENVIRON["OLD"] > "/dev/stderr"
        exit 1
      }
      printf "%s%s%s", substr(text, 1, at - 1), ENVIRON["NEW"], substr(text, at + length(ENVIRON["OLD"]))
    }' "$1" >"$1.part"
  mv "$1.part" "$1"
}

# The true rig, with the names of the robot file. The tips keep their places, so d, s and the height of the lower lens do too.
R=0.06 d=0.12
lower_centre="319.5, 239.5" upper_centre="319.5, 239.5"
lower_focal=708 upper_focal=708 # pixels: direction 1.475 times 480
apex_deg=90
tilt_x_deg=0 tilt_y_deg=0
offset_x=0 offset_y=0
wheel_radius=0.05

lower_direction="<0, 1.475, 0>"
if is centre; then
  # 3 px: the optical axis is at 319.5 + 1.8, 239.5 - 2.4. A pixel is 1/480 of the length unit of direction, and the axis is
  # where direction + right (column - 319.5) / 640 + up (239.5 - row) / 480 points straight up.
  lower_direction="<$(calc "-1.8 / 480"), 1.475, $(calc "2.4 / 480")>"
  lower_centre="321.3, 237.1"
fi
upper_direction="<0, 1.475, 0>"
if is rim; then # 2 px: 238 = focal length * R / (d + R)
  upper_focal=714
  upper_direction="<0, 1.4875, 0>"
fi

# The upper mirror and its camera are one unit: together they tilt about the lens, which is 0.55 m high, and move sideways.
unit=""
if is tilt; then # 0.5 degrees: R_y(0.4) R_x(-0.3)
  tilt_x_deg=$(calc "-0.6 * ${amount[tilt]}") tilt_y_deg=$(calc "0.8 * ${amount[tilt]}")
  unit+=" translate <0, -11, 0> rotate $(calc "-($tilt_x_deg)")*x rotate $(calc "-($tilt_y_deg)")*z translate <0, 11, 0>"
fi
if is offset; then # 2 mm
  offset_x=0.0012 offset_y=-0.0016
  unit+=" translate <$(calc "$offset_x / 0.05"), 0, $(calc "$offset_y / 0.05")>"
fi
height=1.2 # of the cones, POV-Ray units
if is apex; then # 0.3 degrees, both cones; tip and rim radius are unchanged
  apex_deg=90.3
  height=$(calc "1.2 * cos($apex_deg / 2 * pi / 180) / sin($apex_deg / 2 * pi / 180)")
fi
if is wheel_radius; then wheel_radius=$(calc "0.05 * (1 + ${amount[wheel_radius]} / 100)"); fi

change "$scene" "location <0, 5, 0>  direction <0, 1.475, 0>" "location <0, 5, 0>  direction $lower_direction"
change "$scene" "location <0, 11, 0>  direction <0, 1.475, 0>  up <0, 0, -1>  right <4/3, 0, 0>" \
  "location <0, 11, 0>  direction $upper_direction  up <0, 0, -1>  right <4/3, 0, 0>$unit"
change "$scene" "cone { <0, 7.4, 0>, 0 <0, 8.6, 0>, 1.2 open texture { T_Mirror } }" \
  "cone { <0, 7.4, 0>, 0 <0, $(calc "7.4 + $height"), 0>, 1.2 open texture { T_Mirror } }"
change "$scene" "cone { <0, 13.4, 0>, 0 <0, 14.6, 0>, 1.2 open texture { T_Mirror } }" \
  "cone { <0, 13.4, 0>, 0 <0, $(calc "13.4 + $height"), 0>, 1.2 open texture { T_Mirror }$unit }"
change "$scene" "cylinder { <0, 14.6, 0> <0, 14.8, 0> 1.2 texture { T_Dark } }" \
  "cylinder { <0, 14.6, 0> <0, 14.8, 0> 1.2 texture { T_Dark }$unit }"

# v = (d / R + cot(apex / 2)) r_m is the focal length. The apex does not change it, so r_m changes with the apex.
rim() { calc "$1 / ($d / $R + cos($apex_deg / 2 * pi / 180) / sin($apex_deg / 2 * pi / 180))"; }
apex_rad=$(calc "$apex_deg * pi / 180" 17)
lower_rim=$(rim "$lower_focal")
upper_rim=$(rim "$upper_focal")
tilt="$(calc "$tilt_x_deg * pi / 180"), $(calc "$tilt_y_deg * pi / 180")"

# The names are those of `twocone calibrate --json`. For the axes, the offset between them is planted.
jq -n "{
  centre: [\"lower.centre_px.column\", \"lower.centre_px.row\"], rim: [\"upper.rim_radius_px\"],
  tilt: [\"upper.tilt_rad.x\", \"upper.tilt_rad.y\"],
  offset: [\"upper.axis_offset_minus_lower_m.x\", \"upper.axis_offset_minus_lower_m.y\"],
  apex: [\"lower.apex_rad\", \"upper.apex_rad\"], wheel_radius: [\"wheel_radius_m\"]
} as \$names | {
  planted: (\"${!planted[*]}\" | split(\" \") | map({key: ., value: \$names[.]}) | from_entries),
  truth: {
    \"lower.centre_px.column\": ${lower_centre%,*},
    \"lower.centre_px.row\": ${lower_centre#*,},
    \"lower.rim_radius_px\": $lower_rim,
    \"lower.azimuth_rad\": 0,
    \"lower.tilt_rad.x\": 0,
    \"lower.tilt_rad.y\": 0,
    \"lower.axis_offset_m.x\": 0,
    \"lower.axis_offset_m.y\": 0,
    \"lower.apex_rad\": $apex_rad,
    \"lower.mirror_radius_m\": $R,
    \"lower.lens_to_tip_m\": $d,
    \"upper.centre_px.column\": ${upper_centre%,*},
    \"upper.centre_px.row\": ${upper_centre#*,},
    \"upper.rim_radius_px\": $upper_rim,
    \"upper.azimuth_minus_lower_rad\": 0,
    \"upper.tilt_rad.x\": ${tilt%,*},
    \"upper.tilt_rad.y\": ${tilt#*,},
    \"upper.axis_offset_minus_lower_m.x\": $offset_x,
    \"upper.axis_offset_minus_lower_m.y\": $offset_y,
    \"upper.apex_rad\": $apex_rad,
    \"upper.mirror_radius_m\": $R,
    \"upper.lens_to_tip_m\": $d,
    \"lens_height_m\": 0.25,
    \"mirror_separation_m\": 0.30,
    \"wheel_radius_m\": $wheel_radius,
    \"wheel_ratio\": 1,
    \"wheel_separation_m\": 0.30,
    \"upper.azimuth_rad\": 0,
    \"upper.axis_offset_m.x\": $offset_x,
    \"upper.axis_offset_m.y\": $offset_y,
    \"lower.focal_length_px\": $lower_focal,
    \"upper.focal_length_px\": $upper_focal,
    \"left_wheel_radius_m\": $wheel_radius,
    \"right_wheel_radius_m\": $wheel_radius
  }
}" >"$folder/truth.json"

change "$robot" "map: ../scenes/lab.map.yaml " "map: lab.map.yaml "
if [ -n "${RATE_HZ:-}" ]; then
  change "$robot" "rate_hz: 15}     # antialias" "rate_hz: $RATE_HZ}     # antialias"
  change "$robot" "rate_hz: 15}"$'\n\n' "rate_hz: $RATE_HZ}"$'\n\n'
fi
if is wheel_radius || is noise || is gain || is skew || is lost; then
  counts="encoder_counts_per_turn: 1024     # 0: exact angles"
  effects=""
  if is wheel_radius; then effects+=$'\n'"  wheel_radius_m: $wheel_radius            # planted"; fi
  camera=""
  if is gain; then camera+=", gain: ${amount[gain]}"; fi
  if is noise; then
    # A grey level of sRGB at linear light 0.2 is 1 / (255 * 1.055 / 2.4 * 0.2^(1/2.4 - 1)) of full scale. About half of the variance
    # is shot noise with 2000 electrons at full scale, and the rest is read noise.
    sigma=$(calc "${amount[noise]} / (255 * 1.055 / 2.4 * exp((1 / 2.4 - 1) * log(0.2)))")
    full_well=$(calc "0.2 / (0.5 * $sigma * $sigma)")
    camera+=", full_well_electrons: $full_well, read_noise_electrons: $(calc "sqrt(0.5) * $sigma * $full_well")"
  fi
  if is lost; then camera+=", drop_probability: $(calc "${amount[lost]} / 100")"; fi
  if [ -n "$camera" ]; then effects+=$'\n'"  camera: {${camera#, }}            # planted"; fi
  change "$robot" "$counts" "$counts$effects"
  if is skew; then
    line=$(grep "^  upper: {driver: sim_povray" "$robot")
    change "$robot" "$line" "${line%\}*}, effects: {stamp_late_s: $(calc "${amount[skew]} / 1000")}}     # planted"
  fi
fi

cp "$robot" "$perfect"
moved=""
if is tilt; then moved+=$'\n'"    tilt_rad: [$tilt]"; fi
if is offset; then moved+=$'\n'"    axis_offset_m: [$offset_x, $offset_y]"; fi
change "$perfect" "apex_rad: 1.5707963267948966}" "apex_rad: $apex_rad}"
change "$perfect" "centre_px: [319.5, 239.5]       # column" "centre_px: [$lower_centre]       # column"
change "$perfect" "rim_radius_px: 236.0            # r_m" "rim_radius_px: $lower_rim            # r_m"
change "$perfect" $'upper:\n    centre_px: [319.5, 239.5]\n    rim_radius_px: 236.0\n' \
  $'upper:\n    centre_px: ['"$upper_centre"$']\n    rim_radius_px: '"$upper_rim$moved"$'\n'
change "$perfect" "wheel_radius_m: 0.05"$'\n' "wheel_radius_m: $wheel_radius"$'\n'
echo "planted in $folder: $(jq -r '.planted | keys | join(" ")' "$folder/truth.json")" >&2
