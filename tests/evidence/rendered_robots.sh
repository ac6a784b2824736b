# SPDX-License-Identifier: Apache-2.0
# For topics that measure with the rendered robots as built. They source this file after common.sh.
#
# The robots and their drives are those of first-day.sh, where it has rendered them for these sources, or those of the folder
# TWOCONE_RENDERED_ROBOTS.
rendered=${TWOCONE_FIRST_DAY_ROBOTS:-10} # of each room

# each_rendered_robot COMMAND: calls COMMAND ROOM SEED FOLDER for each robot. Those that are missing are rendered first.
each_rendered_robot() {
  local seed room name from
  for seed in $(seq 1 "$rendered"); do
    for room in lab hall workshop; do
      name=${room}_$seed
      from=${TWOCONE_RENDERED_ROBOTS:-$(dirname "$work")/first-day/robots}/$name
      if [ ! -f "$from/calibrated.yaml" ]; then
        from=$work/robots/$name
        step "robot_$name" tests/evidence/robot_as_built.sh "$twocone" "robots/${room}_sim.yaml" "$seed" "$from"
      fi
      "$1" "$room" "$seed" "$from"
    done
  done
}
# Odd seeds have what no model has. model_of 0|1: the words for even and odd seeds
model_of() { [ "$1" = 0 ] && echo "inside the model" || echo "with the unmodelled rest"; }

# of_file FILE KEY: the value in a line KEY VALUE; nothing without it
of_file() { sed -n "s/^$2 //p" "$1" 2>/dev/null; }
# values FOLDER 0|1 KEY: of the files ROOM_SEED.figures in $work/FOLDER with even or odd seeds, sorted
values() {
  local file seed
  for file in "$work/$1"/*.figures; do
    seed=${file##*_}
    [ ! -s "$file" ] || ((${seed%.figures} % 2 != $2)) || of_file "$file" "$3"
  done | sort -g
}
median() { awk '{ v[NR] = $1 } END { if (NR) printf "%.2f", (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }'; }
