#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# capture_cost.sh [BUILD_DIR] - compares the processor time of capturing from two cameras (vivid, 640x480 YUYV at 25 per
# second) with the V4L2 driver, with frames in the device's own format and not copied, to that of two `v4l2-ctl
# --stream-mmap` which do the same. Each time is that of a whole program, user and system time together; the two run in
# turn. Prints `row | WHAT | FIGURE | TARGET | yes|no` lines; exits 0 if all are yes. Needs v4l-utils.
#   ROUNDS (5), FRAMES of each camera and round (500: 20 s)
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(readlink -f "${1:-build/release}")
rounds=${ROUNDS:-5} frames=${FRAMES:-500}
export SCRATCH=${SCRATCH:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm/scratch}
mkdir -p "$SCRATCH"
out=$(readlink -f "$SCRATCH")/capture_cost
rm -rf "$out" && mkdir "$out"

cat > "$out/inside.sh" <<VM
cd '$out'
TIMEFORMAT='%U %S'
ours() { '$build/tests/vm/capture_cost' /dev/video0 /dev/video1 \$1 >> frames 2>&1; }
theirs() {
    for device in 0 1; do
        v4l2-ctl -d\$device --stream-mmap=6 --stream-count=\$1 > /dev/null 2>&1 &
    done
    wait
}
for device in 0 1; do
    v4l2-ctl -d\$device --set-fmt-video=width=640,height=480,pixelformat=YUYV --set-parm=25 > /dev/null
done
ours 25; theirs 25; rm -f frames   # the programs are in the disk's cache from now on
for round in \$(seq $rounds); do
    { time ours $frames || touch failed; } 2>> ours
    { time theirs $frames; } 2>> theirs
done
VM
CPUS=${CPUS:-2} LIMIT=${LIMIT:-$((rounds * frames / 5 + 200))} tests/vm/in-vm.sh "bash '$out/inside.sh'" || echo "the virtual machine: status $?"

# Frames that a busy machine loses do not matter here: both programs must deliver the same number.
echo "-- ours, round by round"; cat "$out/frames"
# The user and system seconds of each round; the result is the median of their sums.
echo "-- rounds: ours, v4l2-ctl (user system)"; paste "$out/ours" "$out/theirs"
median() { awk '{ print $1 + $2 }' "$1" | sort -g | awk '{ a[NR] = $1 } END { print NR % 2 ? a[(NR + 1) / 2] : (a[NR / 2] + a[NR / 2 + 1]) / 2 }'; }
ours=$(median "$out/ours") theirs=$(median "$out/theirs")
share() { awk "BEGIN { printf \"%.1f\", 100 * $1 / ($frames / 25) }"; }
echo "of one processor: $(share "$ours") % and $(share "$theirs") %"
echo

all=yes
row() {  # WHAT FIGURE TARGET yes|no
    echo "row | $1 | $2 | $3 | $4"
    [ "$4" = yes ] || all=no
}
is() { if "$@" > /dev/null; then echo yes; else echo no; fi; }
lent=$(awk '{ n += $2; sum += $6 } END { print n && n == sum ? "all" : sum + 0 " of " n + 0 }' "$out/frames")
ratio=$(awk "BEGIN { printf \"%.2f\", ($theirs > 0) ? $ours / $theirs : 99 }")
row "capture of two cameras: every run got its $frames frames" "$([ -e "$out/failed" ] && echo "not every" || echo every)" every \
    "$(is test ! -e "$out/failed")"
row "capture of two cameras: frames lent, not copied" "$lent" all "$(is test "$lent" = all)"
row "capture of two cameras: processor time, over v4l2-ctl's (median of $rounds)" "$ratio" "<= 1.2" "$(is awk "BEGIN { exit !($ratio <= 1.2) }")"
[ "$all" = yes ]
