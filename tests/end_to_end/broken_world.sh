#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests a simulated world without space for its images, and one with an include file that cannot be read.
#   broken_world.sh TWOCONE SOURCE_DIR
. "$(dirname "$0")/common.sh"
robot=$source_dir/tests/end_to_end/data/small.yaml
lab=$source_dir/scenes/lab.map.yaml

# With a separate and full /dev/shm, each image is rendered by its own process, which is slow, and the program reports that.
if unshare -m true 2>/dev/null; then
  "$twocone" run --renderer povray --robot "$robot" --frames 4 --out "$work/roomy" >/dev/null 2>"$work/errors" || fail "with free space: $(cat "$work/errors")"
  unshare -m env -u XDG_RUNTIME_DIR bash -c '
    mount -t tmpfs -o size=64k tmpfs /dev/shm && head -c 65536 /dev/zero >/dev/shm/filler 2>/dev/null
    exec "$1" run --renderer povray --robot "$2" --frames 4 --out "$3"' sh "$twocone" "$robot" "$work/full" >/dev/null 2>"$work/errors" ||
    fail "a full /dev/shm: $(cat "$work/errors")"
  grep -q 'one POV-Ray process per image' "$work/errors" || fail "a full /dev/shm is not reported: $(cat "$work/errors")"
  for image in "$work"/roomy/*/*.png; do cmp "$image" "$work/full/${image#"$work/roomy/"}" || fail "$image differs"; done
  echo "ok  full /dev/shm: the same images; $(grep 'one POV-Ray process' "$work/errors")"
else
  skip "no mount namespace is available: a full /dev/shm was not tested"
fi

# An include file that cannot be read, and one that is missing.
sed "s|^map:.*|map: $work/lab.map.yaml|" "$robot" >"$work/robot.yaml"
sed 's|^scene:.*|scene: lab.pov|' "$lab" >"$work/lab.map.yaml"
for what in folder missing; do
  { cat "$source_dir/scenes/lab.pov"; echo '#include "parts.inc"'; } >"$work/lab.pov"
  rm -rf "$work/parts.inc" "$work/run"
  [ "$what" = folder ] && mkdir "$work/parts.inc"
  timeout 60 "$twocone" run --renderer povray --robot "$work/robot.yaml" --frames 2 --out "$work/run" >/dev/null 2>"$work/errors"
  status=$?
  sed -i '/^[0-9]* frames; POV-Ray takes some seconds for the first$/d' "$work/errors" # this line is no error
  sed -i -E '/^[-0-9]+T[-+0-9:.]+ warning povray: /d' "$work/errors" # a line of the log: a kernel without Landlock, for example
  ((status == 1)) || fail "include $what: exit $status"
  [ "$(wc -l <"$work/errors")" = 1 ] || fail "include $what: more than one line: $(cat "$work/errors")"
  grep -q 'parts.inc' "$work/errors" || fail "include $what: the file is not named: $(cat "$work/errors")"
  echo "ok  include $what: $(sed "s|$work/||g" "$work/errors")"
done
finish
