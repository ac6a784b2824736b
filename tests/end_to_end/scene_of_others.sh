#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Untrusted or wrong scenes: files that a scene writes and reads, a robot at another place than in the robot file, a scene that
# POV-Ray never finishes parsing, and a scene in place of a map.
#   scene_of_others.sh TWOCONE SOURCE_DIR
. "$(dirname "$0")/common.sh"
robot=$source_dir/tests/end_to_end/data/small.yaml
mkdir "$work/map" "$work/other"
echo "untouched" >"$work/other/notes.txt"
echo "sphere { 0, 1 }" >"$work/other/theirs.inc"

# world NAME TEXT [START]: makes a copy of the lab with TEXT before it, and the robot file NAME.yaml.
world() {
  { head -n 20 "$source_dir/scenes/lab.pov" | grep '#version' || echo '#version 3.7;'; echo "$2"; cat "$source_dir/scenes/lab.pov"; } >"$work/map/$1.pov"
  sed "s|^scene: .*|scene: $1.pov|" "$source_dir/scenes/lab.map.yaml" >"$work/map/$1.map.yaml"
  sed "s|^map:.*|map: $work/map/$1.map.yaml|; s|^start:.*|start: ${3:-{x_m: 0.0, y_m: 0.0, heading_rad: 0.0\}}|" "$robot" >"$work/$1.yaml"
}
run() { "$twocone" run --robot "$work/$1.yaml" --behaviour still --frames 1 --out "$work/run-$1" >"$work/$1.out" 2>"$work/$1.log"; }

world writes "#fopen F \"$work/other/notes.txt\" write #write (F, \"overwritten\") #fclose F"
run writes && fail "a scene that writes was rendered"
grep -q "writes.pov:2: .*Cannot open user file .*(a scene may write no file)" "$work/writes.log" || fail "writes: $(cat "$work/writes.log")"
[ "$(cat "$work/other/notes.txt")" = untouched ] || fail "a scene wrote over a file"

world reads "#include \"$work/other/theirs.inc\""
run reads && fail "a file that the map does not allow was read"
grep -q "add to the map: scene_paths: \[$work/other\]" "$work/reads.log" || fail "reads: $(cat "$work/reads.log")"
echo "scene_paths: [$work/other]" >>"$work/map/reads.map.yaml" # as the message advises
rm -rf "$work/run-reads"
run reads || fail "a file that the map allows is refused: $(cat "$work/reads.log")"
"$twocone" effects --robot "$work/reads.yaml" >"$work/effects.log" || fail "effects"
grep -q "POV-Ray is confined .*$work/other" "$work/effects.log" || fail "effects does not describe the confinement: $(tail -n 1 "$work/effects.log")"

world near "" "{x_m: 0.05, y_m: 0.0, heading_rad: 0.0}"
run near || fail "near: $(cat "$work/near.log")"
grep -q "near.yaml:[0-9]*: start is (0.050, 0.000) m.* shows the robot at (0.000, 0.000) m.*: 50 mm and 0.0 degrees apart" "$work/near.log" || fail "near: $(cat "$work/near.log")"
world far "" "{x_m: 1.0, y_m: 0.0, heading_rad: 0.0}"
run far && fail "a start a metre off was accepted"
grep -q "1000 mm and 0.0 degrees apart, more than body.radius_m" "$work/far.log" || fail "far: $(cat "$work/far.log")"
world wall "" "{x_m: 3.0, y_m: 0.0, heading_rad: 0.0}"
run wall && fail "a start in the wall was accepted"
grep -q "wall.yaml:[0-9]*: start of robot touches wall" "$work/wall.log" || fail "wall: $(cat "$work/wall.log")"

# Stops the program while POV-Ray parses a scene without end. (SIGTERM is used because background jobs of a script ignore SIGINT.)
world endless "#while (1) #end"
setsid "$twocone" run --robot "$work/endless.yaml" --behaviour still --frames 1 --out "$work/run-endless" >/dev/null 2>"$work/endless.log" &
endless=$!
for _ in $(seq 100); do [ -s "$work/endless.log" ] && break; sleep 0.1; done
[ -s "$work/endless.log" ] || fail "nothing is printed in the first 10 s"
sleep 1
kill -TERM "$endless"
for _ in $(seq 200); do kill -0 "$endless" 2>/dev/null || break; sleep 0.1; done
kill -0 "$endless" 2>/dev/null && { kill -9 "$endless"; fail "the program does not stop while the first images are rendered"; }
wait "$endless" && fail "a run that was stopped ended with status 0"
grep -q "interrupted before its first frame" "$work/endless.log" || fail "endless: $(cat "$work/endless.log")"

"$twocone" serve --scene "$work/map/near.pov" >/dev/null 2>"$work/serve.log" && fail "a scene was taken for a map"
grep -q "is a POV-Ray scene; a map is wanted" "$work/serve.log" || fail "serve: $(cat "$work/serve.log")"
finish
