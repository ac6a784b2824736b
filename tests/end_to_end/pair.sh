#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Two programs drive two robots in one world. Each robot must see the other move in its mirrors.
#   pair.sh TWOCONE SOURCE_DIR [FRAMES]
. "$(dirname "$0")/common.sh"
frames=${3:-10}
export XDG_RUNTIME_DIR=$work/runtime
mkdir -m 700 "$XDG_RUNTIME_DIR"
# Without the trolley only the robots move.
sed "/^moving:/,/^[a-z]/{/^moving:/d;/^ *- /d}; s|^scene:.*|scene: $source_dir/scenes/pair/pair.pov|
     s|^scene_paths:.*|scene_paths: [$source_dir/scenes]|" \
  "$source_dir/scenes/pair/pair.map.yaml" >"$work/pair.map.yaml"
for robot in one two; do
  sed "s|^map:.*|map: $work/pair.map.yaml|" "$source_dir/robots/pair/$robot.yaml" >"$work/$robot.yaml"
done
"$twocone" serve --scene "$work/pair.map.yaml" --name hall >"$work/serve.log" 2>&1 &
server=$!
trap 'kill "$server" 2>/dev/null; wait "$server" 2>/dev/null; rm -rf "$work"' EXIT
for _ in $(seq 100); do grep -q "serving 'hall'" "$work/serve.log" && break; sleep 0.1; done
grep -q "serving 'hall'" "$work/serve.log" || fail "serve: $(cat "$work/serve.log")"

# go NAME BEHAVIOUR_ONE BEHAVIOUR_TWO
go() {
  for robot in one two; do
    behaviour=$2
    [ "$robot" = two ] && behaviour=$3
    timeout 300 "$twocone" run --robot "$work/$robot.yaml" --frames "$frames" --behaviour "$behaviour" --out "$work/$1/$robot" \
      >/dev/null 2>"$work/$1.$robot.errors" &
    pids[$([ "$robot" = one ] && echo 1 || echo 2)]=$!
  done
  for i in 1 2; do wait "${pids[$i]}" || fail "$1: robot $i: $(cat "$work/$1".*.errors)"; done
}
mkdir "$work/still" "$work/drive"
go still still still
go drive wander still
last=$(printf '%06d.png' $((frames - 1)))
seen=""
for view in lower upper; do
  # Robot 2 stands in both runs. Its images differ because robot 1 drives in the second run.
  cmp -s "$work/still/two/$view/$last" "$work/drive/two/$view/$last" && fail "$view: robot 2 does not see robot 1 drive"
  seen+=" $view"
done
# Only poses are compared: the robot that attaches second reads other times from the world's clock.
cmp -s <(cut -d' ' -f2- "$work/still/two/truth.tum") <(cut -d' ' -f2- "$work/drive/two/truth.tum") ||
  fail "robot 2 was moved by robot 1's driving"
mkdir "$work/other"
go other still wander
for view in lower upper; do
  cmp -s "$work/still/one/$view/$last" "$work/other/one/$view/$last" && fail "$view: robot 1 does not see robot 2 drive"
done
[ -n "${TWOCONE_KEEP_IMAGES:-}" ] && cp -r "$work/drive" "$work/other" "$TWOCONE_KEEP_IMAGES"
echo "each robot sees the other drive, in both mirrors ($seen ), after $frames frames"
finish
