#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# whole_run.sh [BUILD_DIR] - `twocone run` of one robot on devices and simulated: the same command, and the same binary.
#
# On this machine, stand_in_world is all that is around the robot: a motor controller at a pseudo-terminal, which qemu
# makes an FTDI adapter of, and two views of the simulated world through which the controller's wheels move the robot.
# In the guest, feed_pictures hands the views on to two v4l2loopback cameras, and twocone run drives.
#
# TWOCONE_WHOLE_RUN_OUT, default $SCRATCH/whole_run, then holds
#   run/ sim/                 the run folders on devices and simulated
#   world.csv truth.tum       what the world knew, and of it the pose of each frame of run/
#   run.figures sim.figures   what join_truth tells of either
#
# The cameras' format is RGB3. YUYV, which has one colour for two pixels, makes fixes from the same pictures 1.6 times
# less accurate at this size, since landmarks are found by their hue; with it in loop_real.yaml, that is what one sees.
# FRAMES, default 80: of either run. Other settings: those of in-guest.sh.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(readlink -f "${1:-build/release}")
lab=${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-guest}
export SCRATCH=${SCRATCH:-$lab/scratch}
mkdir -p "$SCRATCH"
SCRATCH=$(readlink -f "$SCRATCH")
out=${TWOCONE_WHOLE_RUN_OUT:-$SCRATCH/whole_run}
frames=${FRAMES:-80}
robots=$PWD/tests/guest/robots
command=(run --frames "$frames" --behaviour wander --seed 1)

failed=0
row() { # WHAT FIGURE TARGET yes|no
    echo "row | whole run: $1 | $2 | $3 | $4"
    [ "$4" = yes ] || failed=1
}
is() { awk "BEGIN { exit !($1) }" && echo yes || echo no; }

# The robot file without the keys in which two files of one robot may differ, and without comments.
shared_keys() {
    sed -E 's/#.*//; /^(map|start):/d
        s/\b(driver|device|format|protocol|port|baud|counts_per_turn): *[^,}]*(, *)?//g; s/ +$//; /^ *$/d' "$1"
}
echo "== the two robot files"
diff "$robots/loop_sim.yaml" "$robots/loop_real.yaml" || true
others=$(diff <(shared_keys "$robots/loop_sim.yaml") <(shared_keys "$robots/loop_real.yaml") || true)
echo "$others"
row 'the robot files differ in other keys than driver: entries with their settings, map: and start:' \
    "$(grep -c '^[<>]' <<< "$others" || true)" 0 "$([ -z "$others" ] && echo yes || echo no)"

if ! find "$lab"/kernel/lib/modules/*/updates -name v4l2loopback.ko 2> /dev/null | grep -q .; then
    MODULES='' tests/guest/in-guest.sh true # which fetches the kernel
    headers=linux-headers-$(ls "$lab/kernel/lib/modules")
    dpkg -s "$headers" > /dev/null 2>&1 || apt-get -q install -y "$headers"
    tests/guest/build-v4l2loopback.sh > /dev/null
fi

echo "== simulated"
mkdir -p "$out"
rm -rf "$out/run" "$out/sim" "$out/world.csv" "$out/truth.tum"
"$build/twocone" "${command[@]}" --robot "$robots/loop_sim.yaml" --out "$out/sim" > "$out/sim.txt"
"$build/tests/guest/join_truth" "$out/sim" | tee "$out/sim.figures"

echo "== on devices"
work=$(mktemp -d "$SCRATCH/whole.XXXXXX")
world=
clean_up() {
    [ -z "$world" ] || kill "$world" 2> /dev/null || true
    rm -rf "$work"
}
trap clean_up EXIT
"$build/tests/guest/stand_in_world" "$robots/loop_sim.yaml" "$robots/loop_real.yaml" "$work" > "$work/world.txt" &
world=$!
for _ in $(seq 600); do
    grep -qs ready "$work/world.txt" && break
    kill -0 "$world" || { echo 'the world did not begin' >&2; exit 1; }
    sleep 0.1
done

camera=$(grep -m1 'lower: {driver' "$robots/loop_real.yaml")
setting() { sed -E "s/.*\b$1: *([^,}]*).*/\1/" <<< "$camera"; }
cat > "$work/in_guest" <<GUEST
port=\$(ls /dev/vport*p*)
'$build/tests/guest/feed_pictures' "\$port" $(setting format) $(setting width_px) $(setting height_px) \
    $(setting rate_hz) /dev/video10 /dev/video11 > /run/feeder &
until grep -qs feeding /run/feeder; do
    kill -0 \$! || exit 1
    sleep 0.2
done
'$build/twocone' ${command[*]} --robot '$robots/loop_real.yaml' --out /run/whole 2>&1 | cat
status=\${PIPESTATUS[0]}
cp -r /run/whole '$work/run'
exit \$status
GUEST
status=0
# As many buffers as the driver asks for: with the usual two, a program that is late gets the one that is being written.
CPUS=${CPUS:-2} LIMIT=${LIMIT:-600} MODULES=$'v4l2loopback devices=2 max_buffers=6 video_nr=10,11 exclusive_caps=1,1\nxhci_pci\nftdi_sio\nvirtio_console' \
    DEVICES="-device qemu-xhci -chardev serial,id=motor,path=$(readlink "$work/motor") -device usb-serial,chardev=motor
        -device virtio-serial-pci -chardev socket,id=pictures,path=$work/pictures
        -device virtserialport,chardev=pictures,name=pictures" \
    tests/guest/in-guest.sh ". '$work/in_guest'" || status=$?
kill "$world" 2> /dev/null || true # it ends with the guest, but not if that never began
wait "$world" || true
world=
cat "$work/world.txt"
row 'exit status on devices' "$status" 0 "$([ "$status" = 0 ] && echo yes || echo no)"
[ ! -d "$work/run" ] || mv "$work/run" "$out/run"
cp "$work/world.csv" "$out/"
[ "$status" = 0 ] || exit 1

"$build/tests/guest/join_truth" "$out/run" "$out/world.csv" "$out/truth.tum" > "$out/run.figures"
cat "$out/run.figures"
figure() { awk -v name="$2" '$1 == name { print $2 }' "$out/$1.figures"; }
ratio() { awk "BEGIN { printf \"%.2f\", $(figure run "$1_mean_m") / $(figure sim "$1_mean_m") }"; }
metres() { awk "BEGIN { printf \"%.2f\", $(figure "$1" travelled_m) }"; }
mm() { awk "BEGIN { printf \"%.2f\", 1000 * $(figure "$1" "$2") }"; }
got=$(figure run frames)
fixes=$(figure run fixes)
row 'frames' "$got" '>= 60' "$(is "$got >= 60")"
row 'frames whose two pictures are those of one instant, bit by bit' "$(figure run of_one_instant)" "$got" \
    "$(is "$(figure run of_one_instant) == $got")"
row 'frames with a fix that is not ambiguous' "$(awk "BEGIN { printf \"%.1f %%\", 100 * $fixes / $got }")" '>= 90 %' "$(is "$fixes >= 0.9 * $got")"
row 'mean error of a fix on devices, simulated, and their ratio' \
    "$(mm run fix_mean_m) mm, $(mm sim fix_mean_m) mm, $(ratio fix)" '<= 1.5' "$(is "$(ratio fix) <= 1.5")"
row 'driven, wandering, without touching anything' "$(metres run) m, $(figure run frames_in_touch) frames in touch" \
    ">= half of the simulated $(metres sim) m, 0" \
    "$(is "$(figure run travelled_m) >= 0.5 * $(figure sim travelled_m) && $(figure run frames_in_touch) == 0")"
row 'greatest skew of a pair' "$(mm run worst_skew_s) ms" "<= max_skew_s, 125 ms" "$(is "$(figure run worst_skew_s) <= 0.1251")"
echo "pairs that the run did not get: $(figure run lost); both cameras told $(figure run lost_told) as lost, and" \
    "the others came when the controller did not answer in time"
# Not asked for: on devices, pictures are stamped and wheels read when the pictures come, after they were rendered.
echo "mean error of the filter's estimate: $(mm run estimate_mean_m) mm, simulated $(mm sim estimate_mean_m) mm; pictures" \
    "were $(figure run mean_delay_s) s old when they were sent"
echo "kept in $out"
exit $failed
