#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A world inside the program and the same world served by another program must give equal bytes, also a second time in the
# world that the first robot has left. A robot that cannot attach must report why.
#   served.sh TWOCONE SOURCE_DIR [ROBOT MAP FRAMES]
. "$(dirname "$0")/common.sh"
robot=${3:-$source_dir/tests/end_to_end/data/small.yaml}
map=${4:-$source_dir/scenes/lab.map.yaml}
frames=${5:-12}
export XDG_RUNTIME_DIR=$work/runtime
mkdir -m 700 "$XDG_RUNTIME_DIR"

# The same robot with `attach:`. Its map gets an absolute path, because the file is in another folder.
sed "s|^map:.*|map: $(realpath "$map")|" "$robot" >"$work/attached.yaml"
echo "attach: served-test" >>"$work/attached.yaml"

"$twocone" run --robot "$work/attached.yaml" --frames 2 --out "$work/unserved" >/dev/null 2>"$work/errors" && fail "attached to a world that is not served"
grep -q "served-test" "$work/errors" || fail "world not served: $(cat "$work/errors")"
[ "$(wc -l <"$work/errors")" = 2 ] || fail "world not served: stderr is not one line about the wait and one about its end: $(cat "$work/errors")"
grep -q "^waiting for the world 'served-test' to be served$" "$work/errors" || fail "the wait is not reported: $(cat "$work/errors")"

# A robot waits for a world that is starting.
"$twocone" run --robot "$work/attached.yaml" --frames 2 --out "$work/early" >/dev/null 2>"$work/early.log" &
early=$!
sleep 0.5
"$twocone" serve --scene "$map" --name served-test >"$work/serve.log" 2>&1 &
server=$!
trap 'kill "$server" 2>/dev/null; wait "$server" 2>/dev/null; rm -rf "$work"' EXIT
for _ in $(seq 100); do grep -q served-test "$work/serve.log" && break; sleep 0.1; done

wait "$early" || fail "the robot did not wait for a world that was starting: $(cat "$work/early.log")"

# The robot's map differs from that of the world.
sed 's/radius_m: 0.15,/radius_m: 0.14,/' "$map" >"$work/other.map.yaml"
sed -i "s|^scene: .*|scene: $(dirname "$(realpath "$map")")/$(sed -n 's/^scene: *//p' "$map")|" "$work/other.map.yaml"
sed "s|^map:.*|map: $work/other.map.yaml|" "$work/attached.yaml" >"$work/other.yaml"
if "$twocone" run --robot "$work/other.yaml" --frames 2 --out "$work/other" >/dev/null 2>"$work/errors"; then fail "another map was accepted"; fi
grep -q "the robot's map is not that of this world: the map has landmark [a-z]*: .*radius 0.140 m; the world has .*radius 0.150 m" "$work/errors" ||
  fail "another map: $(cat "$work/errors")"

"$twocone" run --robot "$robot" --frames "$frames" --seed 5 --out "$work/embedded" >/dev/null 2>"$work/errors" || fail "embedded: $(cat "$work/errors")"
for run in first second; do
  "$twocone" run --robot "$work/attached.yaml" --frames "$frames" --seed 5 --out "$work/$run" >/dev/null 2>"$work/errors" || fail "served: $(cat "$work/errors")"
  # The wall clock differs (host_t_s, the last column of frames.csv).
  cmp <(cut -d, -f1-9 "$work/embedded/frames.csv") <(cut -d, -f1-9 "$work/$run/frames.csv") || fail "$run: frames.csv"
  for table in drive.csv ranges.csv fixes.csv truth.tum odometry.tum estimate.tum track.csv; do
    cmp "$work/embedded/$table" "$work/$run/$table" || fail "$run: $table"
  done
  images=0
  for image in "$work"/embedded/*/*.png; do
    cmp "$image" "$work/$run/${image#"$work/embedded/"}" || fail "$run: $image"
    images=$((images + 1))
  done
  ((images == 2 * frames)) || fail "$images images of $frames frames"
done
echo "byte-equal: 7 tables and $images images, embedded and served, twice"

"$twocone" serve --scene "$map" --name served-test >/dev/null 2>"$work/errors" && fail "one name was served twice"
grep -q "served-test" "$work/errors" || fail "the name is taken: $(cat "$work/errors")"
kill "$server"
for _ in $(seq 50); do kill -0 "$server" 2>/dev/null || break; sleep 0.1; done
wait "$server"
status=$?
[ "$status" = 0 ] || fail "the server was stopped and ended with $status: $(tail -n 2 "$work/serve.log")"
[ -z "$(find "$XDG_RUNTIME_DIR" -name '*.sock')" ] || fail "the socket still exists"
finish
