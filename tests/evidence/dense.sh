#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Range to everything: rooms with texture and without, judged by the native renderer's distances, beside OpenCV's StereoSGBM.
sources=(CMakeLists.txt CMakePresets.json cmake include base hal vision localisation drivers apps scenes robots bench tests/evidence/robot_as_built.sh)
. "$(dirname "$0")/common.sh"
export OMP_NUM_THREADS=1
examples=/usr/share/doc/povray/examples

judged() { build/release/bench/dense_bench "$2" --poses "$3" --antialias 3 --repeats 5 --json "$work/$1.json"; } # NAME ROBOT POSES
of() { jq -r ".[0].$2 // 0" "$work/$1.json" 2>/dev/null || echo 0; } # NAME KEY
percent() { awk "BEGIN { printf \"%.1f %%\", 100 * $1 }"; }
figure_of() { awk "BEGIN { printf \"%.3g\", $1 }"; }

# room NAME WHAT ROBOT POSES texture|plain
room() {
  local name=$1 what=$2 robot=$3 poses=$4 kind=$5
  step "$name" judged "$name" "$robot" "$poses"
  # Of a refused scene, dense_bench writes [] and ends with 0.
  if [ "$(passed "$name")" != yes ] || [ "$(jq length "$work/$name.json" 2>/dev/null)" != 1 ]; then
    row "$what" "$(log "$name" | tail -n 1)" "figures" no
    return
  fi
  local ranged relative median over held unknown
  ranged=$(of "$name" ours.ranged) relative=$(of "$name" ours.relative_error) median=$(of "$name" ours.median_px)
  over=$(of "$name" ours.over_1px) held=$(of "$name" ours.held_95) unknown=$(of "$name" ours.plain_unknown)
  if [ "$kind" = texture ]; then
    row "$what: of $(of "$name" ours.textured) textured pixels that both mirrors see within 5 m, ranged (StereoSGBM)" \
      "$(percent "$ranged") ($(percent "$(of "$name" opencv.ranged)"))" "at least 90 %" "$(holds "$ranged >= 0.9")"
    row "$what: mean relative error (StereoSGBM)" "$(figure_of "$relative") ($(figure_of "$(of "$name" opencv.relative_error)"))" "at most 0.02" "$(holds "$relative <= 0.02")"
    row "$what: median error of the disparity, px (StereoSGBM)" "$(figure_of "$median") ($(figure_of "$(of "$name" opencv.median_px)"))" "at most 0.25" "$(holds "$median <= 0.25")"
    row "$what: more than 1 px off (StereoSGBM)" "$(percent "$over") ($(percent "$(of "$name" opencv.over_1px)"))" "at most 5 %" "$(holds "$over <= 0.05")"
    row "$what: 95 % intervals hold" "$(percent "$held")" "92 to 98 %" "$(holds "$held >= 0.92 && $held <= 0.98")"
  fi
  row "$what: of $(of "$name" ours.plain) untextured pixels, unknown" "$(percent "$unknown")" "at least 95 %" "$(holds "$unknown >= 0.95")"
  local ours half theirs
  ours=$(of "$name" ours_ms) half=$(of "$name" half_ms) theirs=$(of "$name" opencv_ms)
  row "$what: processor time over that of StereoSGBM, medians of $(figure_of "$ours") and $(figure_of "$theirs") ms" \
    "$(figure_of "$ours / $theirs")" "at most 1" "$(holds "$ours <= $theirs")"
  row "$what: half the azimuths, as a scan needs, likewise" "$(figure_of "$half / $theirs")" "at most 0.33" "$(holds "$half <= 0.333 * $theirs")"
}

room study "the study, patterns" robots/scout_sim.yaml 10 texture
step make_designed "$twocone" design --out "$work/designed"
room designed "the room of \`twocone design\`, patterns" "$work/designed/design.yaml" 6 texture
room study_plain "the study, plain paint" robots/scout_plain_sim.yaml 4 plain
room lab "the lab" robots/lab_sim.yaml 4 texture
room workshop "the workshop" robots/workshop_sim.yaml 4 texture
room furnished "the furnished room" robots/furnished_sim.yaml 4 texture

# Scenes of other authors that the native renderer knows, as they are. Their robots are those of `twocone new`, which do not see the floor.
for scene in language/macros/macro1 incdemo/transforms templates/Basic_Scenes/Checkered_plane camera/ultra_wide_angle lights/fillite; do
  name=example_${scene##*/}
  step "make_$name" "$twocone" new "$examples/$scene.pov" --out "$work/$name" --force
  if [ "$(passed "make_$name")" != yes ]; then
    row "$scene of povray-examples" "$(log "make_$name" | tail -n 1)" "figures" no
    continue
  fi
  room "$name" "$scene of povray-examples" "$(ls "$work/$name/"*.yaml | grep -v '\.map\.yaml$')" 2 texture
done

# Robots as built, calibrated on a drive, with the effects of their cameras: TWOCONE_DENSE_ROBOTS=N of them, of 30. Those of odd
# seeds also have what no model has (docs/scenes.md): a mirror that bulges, a lens off its mirror's axis.
robots=${TWOCONE_DENSE_ROBOTS:-30}
as_built() { # SEED
  local folder=$work/as_built_$1
  tests/evidence/robot_as_built.sh "$twocone" robots/scout_sim.yaml "$1" "$folder" || return 1
  "$twocone" scan "$folder/fresh1" --plan | sed -n 's/.*errors \([0-9.]*\) mm and \([0-9.]*\) degrees.*hold \([0-9]*\) %.*and \([0-9]*\) %.*/plan \1 \2 \3 \4/p'
  build/release/bench/dense_bench "$folder/calibrated.yaml" --built "$folder/built.yaml" --poses 3 --antialias 3 --repeats 1 --seed "$1" --json "$work/as_built_$1.json"
  rm -r "$folder"/{drive,fresh1,fresh2}/{lower,upper}
}
for ((seed = 1; seed <= robots; ++seed)); do step "as_built_$seed" as_built "$seed"; done
# built_row WHAT KEY TARGET CONDITION WITHOUT: the median of the robots, with the least and the greatest; also of both kinds alone
built_row() {
  built_row_of "[0-9]*" "robots as built" "$@"
  built_row_of "*[02468]" "those that the model can express" "$@"
  built_row_of "*[13579]" "those with what no model has" "$@"
}
built_row_of() { # SEEDS ROBOTS WHAT KEY TARGET CONDITION WITHOUT
  local seeds=$1 which=$2 values middle
  shift 2
  values=$(for file in "$work"/as_built_$seeds.json; do jq -r ".[0].ours.$2 // empty" "$file"; done 2>/dev/null | sort -g)
  middle=$(awk '{ v[NR] = $1 } END { if (NR) print (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }' <<<"$values")
  row "$which, calibrated: $1, median of $(grep -c . <<<"$values") (least to greatest)" \
    "$(awk -v middle="${middle:-0}" '{ v[NR] = $1 } END { if (NR) printf "%.3g (%.3g to %.3g)", middle, v[1], v[NR] }' <<<"$values")" \
    "$3" "$(holds "${middle:-$5} $4")"
}
failed=0
for ((seed = 1; seed <= robots; ++seed)); do [ "$(passed "as_built_$seed")" = yes ] || failed=$((failed + 1)); done
row "robots as built that were calibrated and ranged" "$((robots - failed)) of $robots" "30 of 30" "$([ $robots -ge 30 ] && [ $failed = 0 ] && echo yes || echo no)"
built_row "share of textured pixels that is ranged" ranged "at least 0.9" ">= 0.9" 0
built_row "mean relative error" relative_error "at most 0.02" "<= 0.02" 9
built_row "median error of the disparity, px" median_px "at most 0.25" "<= 0.25" 9
built_row "share of ranges more than 1 px off" over_1px "at most 0.05" "<= 0.05" 9
built_row "share of 95 % intervals that hold" held_95 "0.92 to 0.98" ">= 0.92" 0
built_row "share of untextured pixels that is unknown" plain_unknown "at least 0.95" ">= 0.95" 0
plans=$(cat "$work"/as_built_*.log | sed -n 's/^plan //p')
plan_row() { # WHAT COLUMN TARGET CONDITION
  local middle
  middle=$(sort -g -k "$2,$2" <<<"$plans" | awk "{ v[NR] = \$$2 } END { if (NR) print (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }")
  row "robots as built: $1, median of $(grep -c . <<<"$plans")" "${middle:-none}" "$3" "$(holds "${middle:-99} $4")"
}
plan_row "error of the position by the floor plan, mm" 1 "at most 20" "<= 20"
plan_row "error of the heading by the floor plan, degrees" 2 "at most 0.3" "<= 0.3"
plan_row "share of positions that its 95 % regions hold, %" 3 "92 to 98" ">= 92"

page "range to everything"
