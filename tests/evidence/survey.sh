#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Maps that robots make themselves: surveys of the rooms of rendered robots as built, against the truth.
also=(tests/evidence/robot_as_built.sh tests/evidence/survey.py tests/evidence/move_landmarks.py tests/evidence/mrpt_slam.cpp tests/evidence/long_corridor.py)
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/rendered_robots.sh"

# surveyed FROM FOLDER: surveys the first drive with the calibrated rig, and localises a later drive on that map and on the true one.
surveyed() {
  local from=$1 folder=$2 kind
  rm -rf "$folder"
  mkdir -p "$folder"
  cp "$from/built.map.yaml" "$folder/"
  "$twocone" survey "$from/drive" --robot "$from/calibrated.yaml" --out "$folder/survey.yaml" || return 1
  for kind in own:survey.yaml true:built.map.yaml; do
    "$twocone" localise "$from/fresh1" --robot "$from/calibrated.yaml" --map "$folder/${kind#*:}" --out "$folder/${kind%:*}" || return 1
  done
}
# moved FROM STEM SEED: surveys a drive beside a map that has one or two landmarks 50 mm from where they are.
moved() {
  mkdir -p "$(dirname "$2")"
  tests/evidence/move_landmarks.py "$1/calibrated.yaml" "$1/believed.map.yaml" "$2" "$3" >"$2.moved" || return 1
  "$twocone" survey "$1/drive" --robot "$2.yaml" --out "$2.out.yaml" --refine --force >"$2.txt"
}
# free KIND FROM FOLDER SEED: surveys a drive with a rig that a ruler measured and a camera whose direction nobody knows. KIND says
# what gives the scale: the mirrors' separation and the wheels (free), one of the two alone, or a distance by tape.
free() {
  local kind=$1 from=$2 folder=$3 distance=()
  rm -rf "$folder"
  mkdir -p "$folder"
  cp "$from/built.map.yaml" "$folder/"
  sed "s#^map: #map: $from/#" "$from/believed.yaml" >"$folder/believed.yaml"
  case $kind in
    separation) sed -i "/^  sigma:/,/^[a-z]/ s/ wheel_radius_m: .*/ wheel_radius_m: 0.02/" "$folder/believed.yaml" ;;
    wheels) sed -i "/^  sigma:/,/^[a-z]/ s/ mirror_separation_m: .*/ mirror_separation_m: 0.05/" "$folder/believed.yaml" ;;
    tape) read -ra distance <<<"--distance $(tests/evidence/survey.py --tape "$work/free/$(basename "$folder")" "$4")" ;;
  esac
  "$twocone" survey "$from/drive" --robot "$folder/believed.yaml" --calibrate "$folder/rig.yaml" --out "$folder/survey.yaml" "${distance[@]}"
}
# MRPT's range-bearing SLAM on the same drive. Its ranges and bearings are those of the calibrated rig and of tops measured by tape.
mrpt_program() {
  local include part=() library=()
  [ -d /usr/include/mrpt/slam ] || { echo "needs Debian's libmrpt-slam-dev" >&2 && return 1; }
  for include in /usr/include/mrpt/*/include; do part+=(-isystem "$include"); done
  for include in slam obs maps poses math rtti serialization system core; do library+=("-lmrpt-$include"); done
  g++ -std=c++17 -O2 "${part[@]}" -isystem /usr/include/eigen3 tests/evidence/mrpt_slam.cpp -o "$work/mrpt_slam" "${library[@]}"
}
mrpt() {
  local from=$1 folder=$2
  "$twocone" localise "$from/drive" --robot "$from/calibrated.yaml" --map "$from/believed.map.yaml" --out "$folder" --force || return 1
  tests/evidence/survey.py --mrpt "$work/mrpt_slam" "$folder" "$from/built.map.yaml" >"$folder.figures"
}
# The corridor with a loop: a run that finds its landmarks on the way, and a survey of it.
corridor() {
  "$twocone" run --robot robots/corridor_sim.yaml --landmarks none --behaviour waypoints --frames 1400 --out "$work/corridor/run" --force || return 1
  cp scenes/corridor.map.yaml "$work/corridor/built.map.yaml"
  tests/evidence/survey.py --track "$work/corridor/run" scenes/corridor.map.yaml >"$work/corridor/track" || return 1
  "$twocone" survey "$work/corridor/run" --frames 360 --out "$work/corridor/survey.yaml" --force
}
mkdir -p "$work/corridor"
step corridor corridor
# The cost: a survey of ten minutes of the lab, by the number of its frames that are used.
long() { "$twocone" run --robot robots/lab_sim.yaml --frames 9000 --seed 5 --out "$work/long" --force; }
step long long
for frames in 45 90 180 360 720; do
  step "cost_$frames" tests/evidence/survey.py --cost "$twocone" survey "$work/long" --frames "$frames" --out "$work/long.$frames.yaml" --force
done
# The cost by the number of landmarks: once round corridors of 15 to 150 m.
many() {
  local count=$1 folder=$work/many/$1 frames
  frames=$(tests/evidence/long_corridor.py "$count" "$folder") || return 1
  "$twocone" run --robot "$folder/corridor.yaml" --landmarks none --behaviour waypoints --frames "$frames" --out "$folder/run" --force || return 1
  cp "$folder/corridor.map.yaml" "$folder/built.map.yaml"
  tests/evidence/survey.py --track "$folder/run" "$folder/corridor.map.yaml" >"$folder/track" || return 1
  tests/evidence/survey.py --cost "$twocone" survey "$folder/run" --frames 360 --out "$folder/survey.yaml" --force >"$folder/cost"
}
for count in 6 12 24 60; do step "many_$count" many "$count"; done
step mrpt_program mrpt_program
mkdir -p "$work/mrpt"
cases=0 right=0 missed=0 wrong=0
inside=() beyond=()
measure_robot() { # ROOM SEED FOLDER
  local room=$1 seed=$2 from=$3 name=$1_$2 kind case stem named truth
  step "survey_$name" surveyed "$from" "$work/surveys/$name"
  step "mrpt_$name" mrpt "$from" "$work/mrpt/$name"
  for kind in free tape separation wheels; do
    if [[ $kind = separation || $kind = wheels ]] && ((seed % 2)); then continue; fi
    step "${kind}_$name" free "$kind" "$from" "$work/$kind/$name" "$seed"
  done
  if [ "$room" = lab ]; then
    for case in 1 2 3 4 5; do
      stem=$work/moved/${name}_$case
      step "moved_${name}_$case" moved "$from" "$stem" $((10 * seed + case))
      [ -f "$stem.txt" ] || continue
      named=$(sed -n 's/ was moved by .*//p' "$stem.txt" | sort)
      truth=$(tr ' ' '\n' <"$stem.moved" | sort)
      ((++cases))
      [ "$named" != "$truth" ] || ((++right))
      missed=$((missed + $(comm -13 <(echo "$named") <(echo "$truth") | sed '/^$/d' | wc -l)))
      wrong=$((wrong + $(comm -23 <(echo "$named") <(echo "$truth") | sed '/^$/d' | wc -l)))
    done
  fi
  if ((seed % 2)); then beyond+=("$work/surveys/$name"); else inside+=("$work/surveys/$name"); fi
}
each_rendered_robot measure_robot
figures() { tests/evidence/survey.py "${@:2}" >"$work/$1.figures" 2>"$work/$1.robots" || true; }
of() { of_file "$work/$1.figures" "$2"; }
for kind in "0 inside 2" "1 beyond 3"; do
  read -r odd name limit <<<"$kind"
  what=$(model_of "$odd")
  if [ "$name" = inside ]; then figures inside "${inside[@]}"; else figures beyond "${beyond[@]}"; fi
  row "surveys of rendered robots, $what, $(of "$name" robots): landmarks found" "$(of "$name" found) of $(of "$name" landmarks), $(of "$name" ghosts) that are none" \
    "all, and none that is none" "$(holds "\"$(of "$name" found)\" == \"$(of "$name" landmarks)\" && \"$(of "$name" ghosts)\" == \"0\"")"
  row "the same: landmarks after similarity alignment, rms of a robot" \
    "median $(of "$name" similarity_mm) mm, worst $(of "$name" worst_mm) mm; at most $limit mm in $(of "$name" "within_${limit}_mm")" "at most $limit mm in each" \
    "$(holds "\"$(of "$name" worst_mm)\" ~ /[0-9]/ && $(of "$name" worst_mm) + 0 <= $limit")"
  # 99 % of the band of a chi-squared with n degrees of freedom, n large: n +- 2.58 sqrt(2 n)
  row "the same: chi-squared of the maps' shapes" "$(of "$name" chi_squared) of $(of "$name" freedom) degrees of freedom" "within its 99 % band" \
    "$(holds "$(of "$name" freedom) + 0 > 0 && ($(of "$name" chi_squared) - $(of "$name" freedom)) ^ 2 <= 6.66 * 2 * $(of "$name" freedom)")"
  row "the same: mean error of fixes on the own map, over that on the true map, median of the robots" "$(of "$name" ratio)" "at most 1.2" \
    "$(holds "\"$(of "$name" ratio)\" ~ /[0-9]/ && $(of "$name" ratio) + 0 <= 1.2")"
done
for odd in 0 1; do
  errors=$(values mrpt "$odd" similarity_mm)
  figure=${errors:+"median $(median <<<"$errors") mm, worst $(tail -n 1 <<<"$errors") mm, $(wc -l <<<"$errors") robots"}
  row "MRPT's range-bearing SLAM on the same drives, with tops by tape and told which landmark is which; robots $(model_of "$odd"): landmarks after similarity alignment, rms of a robot" \
    "$figure" "the figure" "$(holds "\"$figure\" != \"\"")"
done
for kind in free tape separation wheels; do
  mapfile -t folders < <(ls -d "$work/$kind"/* 2>/dev/null)
  figures "$kind" "${folders[@]}"
  case $kind in
    free) what="the separation of the mirrors to 3 mm and wheels to 3 %" ;;
    tape) what="a distance of 3 m by tape to 2 mm besides" ;;
    separation) what="the separation of the mirrors to 3 mm alone" ;;
    wheels) what="wheels to 3 % alone" ;;
  esac
  row "surveys that find the rig, too, from one measured by ruler with cameras turned by an unknown angle; scale by $what; $(of "$kind" robots): landmarks found" \
    "$(of "$kind" found) of $(of "$kind" landmarks), $(of "$kind" ghosts) that are none" "all, and none that is none" \
    "$(holds "\"$(of "$kind" found)\" != \"\" && \"$(of "$kind" found)\" == \"$(of "$kind" landmarks)\" && \"$(of "$kind" ghosts)\" == \"0\"")"
  row "the same: landmarks after similarity alignment, rms of a robot" \
    "median $(of "$kind" similarity_mm) mm, worst $(of "$kind" worst_mm) mm; at most 3 mm in $(of "$kind" within_3_mm)" "at most 3 mm in each" \
    "$(holds "\"$(of "$kind" worst_mm)\" ~ /[0-9]/ && $(of "$kind" worst_mm) + 0 <= 3")"
  if [ "$kind" = tape ]; then
    row "the same: landmarks after rigid alignment" \
      "median $(of tape rigid_mm) mm, worst $(of tape worst_rigid_mm) mm; at most 3 mm in $(of tape rigid_within_3_mm)" "at most 3 mm in each" \
      "$(holds "\"$(of tape worst_rigid_mm)\" ~ /[0-9]/ && $(of tape worst_rigid_mm) + 0 <= 3")"
  fi
  robots=$(of "$kind" robots)
  robots=${robots%% *}
  row "the same: scale, chi-squared of its errors over the stated sigmas" \
    "$(of "$kind" scale_chi_squared) of ${robots:-0} robots, worst $(of "$kind" worst_scale_sigmas) sigma; median error $(of "$kind" scale_percent) %, sigma $(of "$kind" scale_sigma_percent) %" \
    "within its 99 % band" "$(holds "${robots:-0} > 0 && ($(of "$kind" scale_chi_squared) + 0 - ${robots:-0}) ^ 2 <= 6.66 * 2 * ${robots:-0}")"
  block "Robots: scale by $what" "$(cat "$work/$kind.robots")"
done
figures corridor "$work/corridor"
track=$work/corridor/track
row "a corridor of 30 m round a block, 12 landmarks of 6 colours, surveyed: landmarks found" "$(of corridor found) of $(of corridor landmarks), $(of corridor ghosts) that are none" \
  "all, and none that is none" "$(holds "\"$(of corridor found)\" == \"12\" && \"$(of corridor ghosts)\" == \"0\"")"
row "the same: landmarks after similarity alignment, rms" "$(of corridor similarity_mm) mm; scale $(of corridor scale_percent) %" "at most 2 mm" \
  "$(holds "\"$(of corridor similarity_mm)\" ~ /[0-9]/ && $(of corridor similarity_mm) + 0 <= 2")"
row "the same corridor while driving, once round: landmarks" "$(of_file "$track" found) of $(of_file "$track" landmarks), $(of_file "$track" more) more; errors median $(of_file "$track" landmark_mm) mm, worst $(of_file "$track" worst_landmark_mm) mm" \
  "each once" "$(holds "\"$(of_file "$track" found)\" == \"12\" && \"$(of_file "$track" more)\" == \"0\"")"
row "the same: error of the track, mean of the way and of the last two seconds" "$(of_file "$track" mean_mm) mm, $(of_file "$track" last_mm) mm" "the figure" \
  "$(holds "\"$(of_file "$track" mean_mm)\" ~ /[0-9]/")"
row "the same: normalised error squared of the pose, mean" "$(of_file "$track" nees)" "3; errors of neighbouring frames are one" \
  "$(holds "\"$(of_file "$track" nees)\" ~ /[0-9]/ && $(of_file "$track" nees) + 0 <= 4.5")"
row "a survey of a drive of 9,000 frames, with the frames that are used unless told: time, greatest memory" "$(of_file "$work/cost_180.log" seconds) s, $(of_file "$work/cost_180.log" mib) MiB" \
  "at most 300 s and 1024 MiB" "$(holds "\"$(of_file "$work/cost_180.log" seconds)\" ~ /[0-9]/ && $(of_file "$work/cost_180.log" seconds) + 0 <= 300 && $(of_file "$work/cost_180.log" mib) + 0 <= 1024")"
# exponent KEY FEW MANY TIMES: of the value in two files, where the second has TIMES as many
exponent() { awk -v a="$(of_file "$2" "$1")" -v b="$(of_file "$3" "$1")" -v times="$4" 'BEGIN { if (a > 0 && b > 0) printf "%.2f", log(b / a) / log(times) }'; }
growth() { exponent "$1" "$work/cost_90.log" "$work/cost_720.log" 8; }
row "the same: exponents of time and memory by the number of used frames, 90 to 720" "$(growth seconds), $(growth mib)" "the figure" "$(holds "\"$(growth seconds)\" ~ /[0-9]/")"
for count in 6 12 24 60; do
  folder=$work/many/$count
  figures "many_$count" "$folder"
  row "a corridor of $((count * 5 / 2)) m round a block, $count landmarks of 6 colours, 360 frames used: landmarks found; rms after similarity alignment; time and greatest memory of the survey" \
    "$(of "many_$count" found) of $count, $(of "many_$count" ghosts) that are none; $(of "many_$count" similarity_mm) mm; $(of_file "$folder/cost" seconds) s, $(of_file "$folder/cost" mib) MiB" \
    "all, and none that is none" "$(holds "\"$(of "many_$count" found)\" == \"$count\" && \"$(of "many_$count" ghosts)\" == \"0\"")"
  row "the same while driving: landmarks; error of the track, mean" "$(of_file "$folder/track" found) of $count, $(of_file "$folder/track" more) more; $(of_file "$folder/track" mean_mm) mm" \
    "each once" "$(holds "\"$(of_file "$folder/track" found)\" == \"$count\" && \"$(of_file "$folder/track" more)\" == \"0\"")"
done
by_landmarks() { exponent "$1" "$work/many/6/cost" "$work/many/60/cost" 10; }
row "the same: exponents of time and memory by the number of landmarks, 6 to 60" "$(by_landmarks seconds), $(by_landmarks mib)" "the figure" "$(holds "\"$(by_landmarks seconds)\" ~ /[0-9]/")"
row "maps measured by tape (5 mm), one or two of six landmarks moved by 50 mm since, $cases cases" \
  "all right in $right; $missed moved ones not named, $wrong named that were not moved" "all named, and none that was not moved" \
  "$(holds "$cases >= 50 && $right == $cases")"
block "Robots inside the model" "$(cat "$work/inside.robots")"
block "Robots with the unmodelled rest" "$(cat "$work/beyond.robots")"
page "surveys"
