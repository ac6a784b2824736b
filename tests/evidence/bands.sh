#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Banded landmarks: wrong numbers in a room full of colours, how far and in which light they are read, their ranges
# beside those of coloured landmarks of the same size, robots as built among them, and a survey of them.
also=(tests/evidence/bands.py tests/evidence/survey.py tests/evidence/robot_as_built.sh)
. "$(dirname "$0")/common.sh"

bands=tests/evidence/bands.py
room=robots/furnished_sim.yaml
of() { sed -n "s/^$2 //p" "$work/$1.log" 2>/dev/null; }

# Wrong numbers: the map lists all 64 numbers, 52 of which the room does not have.
$bands map scenes/furnished.map.yaml >"$work/all.map.yaml"
drives=12
false_numbers() {
  local run=$work/false/$1 light=()
  case $(($1 % 3)) in
    1) light=(--set "effects.camera={gain: 0.3, full_well_electrons: 8000, read_noise_electrons: 8}") ;;
    2) light=(--set cameras.lower.antialias=3 --set cameras.upper.antialias=3) ;;
  esac
  "$twocone" run --robot "$room" --set "map=$work/all.map.yaml" "${light[@]}" --frames 1300 --seed "$1" --out "$run" --force || return 1
  rm -r "$run/lower" "$run/upper" "$run/methods"
}
for seed in $(seq 1 "$drives"); do step "false_$seed" false_numbers "$seed"; done
mapfile -t runs < <(ls -d "$work/false"/* 2>/dev/null)
rm -f "$work/false.status"
step false $bands false "${runs[@]}"

# By distance, in a third and a tenth of the light, with a noisy camera
light() { "$twocone" run --robot "$room" --set "effects.camera={gain: $2, full_well_electrons: 8000, read_noise_electrons: 8}" --frames 450 --seed 3 --out "$work/light/$1" --force; }
for kind in full:1 third:0.33 tenth:0.1; do
  step "light_${kind%:*}" light "${kind%:*}" "${kind#*:}"
  step "distances_${kind%:*}" $bands ranges "$work/light/${kind%:*}"
done

# Beside coloured ones: pipes of the same size at the same places of the lab, the same drive
for kind in coloured banded; do
  mkdir -p "$work/lab"
  $bands room "$kind" "$work/lab"
  for rays in 1 3; do
    name=${kind}_$rays
    step "lab_$name" "$twocone" run --robot robots/lab_sim.yaml --set "map=$work/lab/$kind.map.yaml" --set "cameras.lower.antialias=$rays" \
      --set "cameras.upper.antialias=$rays" --frames 300 --seed 1 --out "$work/lab/$name" --force
    step "errors_$name" $bands errors "$work/lab/$name"
    step "fixes_$name" $bands fixes "$work/lab/$name"
  done
done

# Robots as built, and a survey
robots=6
for seed in $(seq 1 "$robots"); do step "robot_$seed" tests/evidence/robot_as_built.sh "$twocone" "$room" "$seed" "$work/robots/$seed"; done
mapfile -t fresh < <(ls -d "$work/robots"/*/fresh? 2>/dev/null)
step built $bands fixes "${fresh[@]}"
surveyed() {
  "$twocone" run --robot "$room" --landmarks none --frames 600 --seed 2 --out "$work/survey/run" --force || return 1
  cp scenes/furnished.map.yaml "$work/survey/built.map.yaml"
  "$twocone" survey "$work/survey/run" --out "$work/survey/survey.yaml" --force
}
mkdir -p "$work/survey"
step survey surveyed
step surveyed tests/evidence/survey.py "$work/survey"

row "sightings of banded landmarks in a room full of colours, blinds, books and striped vases, ${#runs[@]} drives in three kinds of light: those with a wrong number" \
  "$(of false wrong_numbers) of $(of false sightings); $(of false refused) readings refused because their size contradicts the map" \
  "none of 100,000" "$(holds "\"$(of false wrong_numbers)\" == \"0\" && $(of false sightings) + 0 >= 100000")"
row "the same: ranges that are off by more than 50 mm and six sigmas" "$(of false wrong_ranges)" "none" "$(holds "\"$(of false wrong_ranges)\" == \"0\"")"
for rays in 1 3; do
  what="each pixel one ray"
  [ "$rays" = 1 ] || what="9 rays a pixel"
  row "the lab with six pipes of 110 mm, $what: median and rms error of ranges, banded beside coloured" \
    "$(of errors_banded_$rays range_median_mm) and $(of errors_banded_$rays range_rms_mm) mm of $(of errors_banded_$rays ranged); coloured $(of errors_coloured_$rays range_median_mm) and $(of errors_coloured_$rays range_rms_mm) mm of $(of errors_coloured_$rays ranged)" \
    "banded not worse" "$(holds "$(of errors_banded_$rays range_median_mm) + 0 > 0 && $(of errors_banded_$rays range_median_mm) + 0 <= $(of errors_coloured_$rays range_median_mm) + 0")"
  row "the same: mean error of fixes, and fixes within their 95 % ellipses, banded beside coloured" \
    "$(of fixes_banded_$rays mean_mm) mm, $(of fixes_banded_$rays within_95) %; coloured $(of fixes_coloured_$rays mean_mm) mm, $(of fixes_coloured_$rays within_95) %" \
    "90 % or more within" "$(holds "$(of fixes_banded_$rays within_95) + 0 >= 90")"
  row "the same: vision of a frame, median, banded beside coloured" "$(of errors_banded_$rays vision_ms) ms beside $(of errors_coloured_$rays vision_ms) ms" "the figure" \
    "$(holds "$(of errors_banded_$rays vision_ms) + 0 > 0")"
done
row "$robots robots as built in the furnished room, half of them with what no model has, calibrated on their first drive: fixes of later drives" \
  "mean $(of built mean_mm) mm, worst $(of built worst_mm) mm, $(of built within_95) % of $(of built fixes) within their 95 % ellipses" "90 % or more within" \
  "$(holds "$(of built within_95) + 0 >= 90")"
row "a survey of the furnished room: landmarks found, rms after similarity alignment" \
  "$(of surveyed found) of $(of surveyed landmarks), $(of surveyed ghosts) that are none; $(of surveyed similarity_mm) mm, scale $(of surveyed scale_percent) %" "none that is none, at most 2 mm" \
  "$(holds "\"$(of surveyed ghosts)\" == \"0\" && $(of surveyed similarity_mm) + 0 > 0 && $(of surveyed similarity_mm) + 0 <= 2")"
for kind in full third tenth; do
  block "By distance, noisy camera, light: $kind" "$(cat "$work/distances_$kind.log")"
done
page "banded landmarks"
