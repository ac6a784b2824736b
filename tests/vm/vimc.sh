#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# vimc.sh [BUILD_DIR] - tests the libcamera driver in the virtual machine with the kernel's vimc camera: frames at the
# adjusted size, the faults of faultshim.c, an unplug, and valgrind. Needs build-vimc.sh once, Debian's libcamera-ipa,
# valgrind, a C compiler. Prints a `row | WHAT | FIGURE | TARGET | yes|no` for each claim; exits 0 if all are yes.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(readlink -f "${1:-build/release}")
export SCRATCH=${SCRATCH:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm/scratch}
mkdir -p "$SCRATCH"
SCRATCH=$(readlink -f "$SCRATCH")
out=$SCRATCH/vimc
rm -rf "$out" && mkdir "$out"
cc -shared -fPIC -o "$out/faultshim.so" tests/vm/faultshim.c -ldl

cat > "$out/inside.sh" <<VM
probe=$build/tests/vm/libcamera_probe
cd '$out'
export LIBCAMERA_LOG_LEVELS='*:ERROR'
camera=\$("\$probe" list 2> list.err | tee list.log | sed -n 's/^camera \(.*\) | .*/\1/p' | head -1)
run() {  # NAME SECONDS [stop|recover]: writes the lines of the probe to NAME.log, and then its exit status
    local name=\$1; shift
    local status=0
    timeout 100 \$wrap "\$probe" "\$camera" 640 480 \$rate "\$@" > "\$name.log" 2> "\$name.err" || status=\$?
    echo "exit \$status" >> "\$name.log"
}
rate=20 wrap=
for try in 1 2 3; do  # tries again if the machine was too slow
    run steady 20
    awk '/^frames [0-9]/ && \$2 >= 360 && \$6 == 0 { good = 1 } END { exit !good }' steady.log && break
    cat steady.log > "spoilt-\$try.log"
done
run controls 2 - Brightness=0.5 Contrast=99
run wrong 2 - Sharpnes=1
for fault in stall error nodev; do
    LD_PRELOAD=\$PWD/faultshim.so FAULT=\$fault AFTER=40 run \$fault 10 stop
done
rate=2 wrap='valgrind --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite --log-file=memcheck'
run valgrind 15
# The unplug comes last, and the camera is not bound again: libcamera 0.0.3 notices that only with USB cameras.
rate=20 wrap=
(sleep 6; echo vimc.0 > /sys/bus/platform/drivers/vimc/unbind) &
run unplug 20 gone
wait
VM
MODULES=vimc LIMIT=${LIMIT:-500} tests/vm/in-vm.sh "bash '$out/inside.sh'" || echo "the virtual machine: status $?"

all=yes
row() {  # WHAT FIGURE TARGET yes|no
    echo "row | $1 | $2 | $3 | $4"
    [ "$4" = yes ] || all=no
}
is() { if "$@" > /dev/null; then echo yes; else echo no; fi; }
line() { grep -m1 "^$2" "$out/$1.log" || echo "no '$2' in $1.log"; }
# Prints the number that follows a word of a line.
after() { sed -n "s/.*\\b$2 \\([0-9.]*\\).*/\\1/p" <<< "$1"; }
ended() { grep -q '^closed' "$out/$1.log" && grep -qx 'exit 0' "$out/$1.log"; }

for log in "$out"/spoilt-*.log; do [ ! -e "$log" ] || echo "repeated, because the machine was too slow: $(basename "$log")"; done
for log in list steady controls wrong stall error nodev valgrind unplug; do
    echo "-- $log"; cat "$out/$log.log" 2>/dev/null || echo "no $log.log"
done
echo

applied=$(line steady applied) frames=$(line steady 'frames [0-9]')
row "libcamera: size applied for 640x480" "$(after "$applied" applied)x480" "636x480, reported" \
    "$(is grep -q '^applied 636x480 ' "$out/steady.log")"
count=$(after "$frames" frames)
row "libcamera: 20 s of frames, all of that size" "${count:-0}, wrong $(after "$frames" wrong), out of order $(after "$frames" backwards)" ">= 360, 0, 0" \
    "$(is awk "BEGIN { exit !(${count:-0} >= 360 && \"$frames\" ~ /wrong 0 backwards 0/) }")"
row "libcamera: frames lost in them" "$(after "$frames" lost)" 0 "$(is grep -q '^frames .* lost 0 ' "$out/steady.log")"
row "libcamera: starts again, a frame outlives its camera" "$(grep -c -e '^started again: a frame' -e '^its last frame is still there' "$out/steady.log" || true) of 2" 2 \
    "$(is test "$(grep -c -e '^started again: a frame' -e '^its last frame is still there' "$out/steady.log")" = 2)"
row "libcamera: controls set and reported, within their limits" "$(sed -n 's/^control //p' "$out/controls.log" | paste -sd,)" "Brightness 0.5,Contrast < 99" \
    "$(is awk '/^control Brightness 0.5$/ { a = 1 } /^control Contrast/ && $3 < 99 { b = 1 } END { exit !(a && b) }' "$out/controls.log")"
row "libcamera: a control that it does not have" "$(line wrong 'not configured')" "refused, naming the ones that it has" \
    "$(is grep -q '^not configured: .*no control Sharpnes; it has: Brightness, Contrast, Saturation' "$out/wrong.log")"
fault() {  # LOG WHAT CODES: checks the code and delay of the first error, and a clean end
    local error delay
    error=$(line "$1" error) delay=$(sed -n 's/^error [A-Za-z]* \([0-9]*\) ms.*/\1/p' <<< "$error")
    row "libcamera: $2" "$(cut -d' ' -f2 <<< "$error") after ${delay:-no} ms" "$3, <= 1000 ms" \
        "$(is awk "BEGIN { exit !(\"$error\" ~ /^error ($4) / && \"$delay\" != \"\" && $((${delay:-9999})) <= 1000) }")"
    row "libcamera: $2: stopped, and ended" "$(tail -1 "$out/$1.log")" "exit 0" "$(is ended "$1")"
}
fault stall "frames stop coming" Timeout Timeout
fault error "frames arrive damaged" BadData BadData
fault nodev "every call fails" "Disconnected or Timeout" 'Disconnected|Timeout'
# The delay of the first error after the last frame, and the code of the last error.
reported=$(awk '/^frames again/ { first = "" } /^error/ { if (!first) first = $3; last = $2 } END { print last, "first reported after", first, "ms" }' "$out/unplug.log")
row "libcamera: the device is unbound" "$reported" "Disconnected, first reported <= 1000 ms" \
    "$(is awk "BEGIN { split(\"$reported\", t); exit !(t[1] == \"Disconnected\" && t[5] + 0 > 0 && t[5] <= 1000) }")"
row "libcamera: the device is unbound: stopped, and ended" "$(tail -1 "$out/unplug.log")" "exit 0" "$(is ended unplug)"
errors=$(sed -n 's/.*ERROR SUMMARY: \([0-9]*\) errors.*/\1/p' "$out/memcheck")
row "libcamera: errors and lost memory by valgrind" "${errors:-no answer}" 0 "$(is test "${errors:-1}" = 0)"
row "libcamera: under valgrind: stopped, and ended" "$(tail -1 "$out/valgrind.log")" "exit 0" "$(is ended valgrind)"
[ "$all" = yes ]
