#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Maps made while driving (run --landmarks none): the pose beside that on the true map, and 20 minutes with a person who walks about.
also=(tests/evidence/robot_as_built.sh tests/evidence/survey.py)
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/rendered_robots.sh"

mkdir -p "$work/person" "$work/own"
# The lab with a person in orange and blue, who crosses it again and again.
lab_with_person() {
  local folder=$work/person/lab
  mkdir -p "$folder"
  awk '/PMName robot/ { print "  //*PMName moving.person"
      print "  cylinder { <0, 0, 2> <0, 16, 2> 1.4 pigment { color rgb <0.10, 0.12, 0.20> } }"
      print "  cylinder { <0, 0, -2> <0, 16, -2> 1.4 pigment { color rgb <0.10, 0.12, 0.20> } }"
      print "  cylinder { <0, 16, 0> <0, 29, 0> 4 pigment { color rgb <0.80, 0.30, 0.02> } }"
      print "  sphere { <0, 32, 0>, 2.4 pigment { color rgb <0.70, 0.52, 0.42> } }"
      print "  translate W(-1.5, -2.0, 0)\n}\nunion {\n  //*PMName robot"; next } { print }' scenes/lab.pov >"$folder/lab.pov"
  sed "s#^scene: .*#scene: lab.pov\nscene_paths: [$PWD/scenes/parts]#" scenes/lab.map.yaml >"$folder/lab.map.yaml"
  echo "moving:
  - {name: person, path_m: [[-1.5, -2.0], [0.9, 0.0], [-0.2, 1.9], [-2.0, 0.2], [1.9, 1.4], [0.3, -1.9]], speed_mps: 0.7, loop: true, radius_m: 0.25}" >>"$folder/lab.map.yaml"
  sed "s#^map: .*#map: lab.map.yaml#" robots/lab_sim.yaml >"$folder/robot.yaml"
  "$twocone" run --robot "$folder/robot.yaml" --landmarks none --frames 18000 --seed 3 --out "$work/person/run" --force || return 1
  tests/evidence/survey.py --track "$work/person/run" "$folder/lab.map.yaml" >"$work/person/figures"
}
step person lab_with_person
# own FROM FOLDER: a robot as built, calibrated, makes its own map; the same images again on the true map
own() {
  local from=$1 folder=$2
  "$twocone" run --robot "$from/calibrated.yaml" --landmarks none --frames 450 --seed "3${from##*_}" --out "$folder/own" --force || return 1
  "$twocone" localise "$folder/own" --robot "$from/calibrated.yaml" --map "$from/built.map.yaml" --out "$folder/true" --force || return 1
  tests/evidence/survey.py --track "$folder/own" "$from/built.map.yaml" "$folder/true" >"$folder.figures"
}
measure_robot() { step "own_$1_$2" own "$3" "$work/own/$1_$2"; } # ROOM SEED FOLDER
each_rendered_robot measure_robot
person=$work/person/figures
row "20 minutes in the lab with a person who walks about: landmarks" \
  "$(of_file "$person" found) of $(of_file "$person" landmarks), $(of_file "$person" more) more; errors median $(of_file "$person" landmark_mm) mm, worst $(of_file "$person" worst_landmark_mm) mm" \
  "each once, and no other" "$(holds "\"$(of_file "$person" found)\" == \"6\" && \"$(of_file "$person" more)\" == \"0\"")"
row "the same: error of the track, mean" "$(of_file "$person" mean_mm) mm" "the figure" "$(holds "\"$(of_file "$person" mean_mm)\" ~ /[0-9]/")"
# 95 % of the band of a chi-squared with 3 degrees of freedom, of one frame
row "the same: normalised error squared of the pose, mean of the frames; share of frames beyond 7.81, of which 5 % are expected" \
  "$(of_file "$person" nees), $(of_file "$person" beyond_percent) %" "3, at most 5 %" \
  "$(holds "\"$(of_file "$person" beyond_percent)\" ~ /[0-9]/ && $(of_file "$person" beyond_percent) + 0 <= 5")"
sum() { awk '{ s += $1 } END { print s + 0 }'; }
for odd in 0 1; do
  own_values() { values own "$odd" "$1"; }
  robots=$(own_values mean_mm | wc -l)
  row "robots as built, $(model_of "$odd"), $robots of them, 30 s: landmarks" "$(own_values found | sum) of $(own_values landmarks | sum), $(own_values more | sum) more" \
    "each once, and no other" "$(holds "$robots > 0 && $(own_values found | sum) == $(own_values landmarks | sum) && $(own_values more | sum) == 0")"
  row "the same: error of the track in the second half, laid over the truth by the similarity of the landmarks (weighted by their variances), over that on the true map with the same images, median and worst robot" \
    "$(own_values laid_ratio | median), $(own_values laid_ratio | tail -n 1)" "at most 2" \
    "$(holds "\"$(own_values laid_ratio | median)\" ~ /[0-9]/ && $(own_values laid_ratio | tail -n 1) + 0 <= 2")"
  row "the same: that error, median robot: own map, laid over the truth; own map, in the world of the start pose; true map" \
    "$(own_values laid_mm | median) mm; $(own_values half_mm | median) mm; $(own_values true_mm | median) mm" "the figure" "$(holds "$robots > 0")"
  row "the same: share of frames with a normalised error squared of the pose beyond 7.81, of which 5 % are expected, median robot" \
    "$(own_values beyond_percent | median) %" "at most 5 %" "$(holds "\"$(own_values beyond_percent | median)\" ~ /[0-9]/ && $(own_values beyond_percent | median) + 0 <= 5")"
  row "the same: normalised error squared of the landmarks' places, median robot" "$(own_values place_nees | median)" "2" \
    "$(holds "\"$(own_values place_nees | median)\" ~ /[0-9]/ && $(own_values place_nees | median) + 0 <= 3")"
done
page "maps made while driving"
