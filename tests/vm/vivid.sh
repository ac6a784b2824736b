#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# vivid.sh [BUILD_DIR] - tests the V4L2 driver with two virtual cameras of the kernel (vivid), in the virtual machine: a
# minute without a fault, every fault that they can emulate while the pair streams, unplugging, and a run under valgrind.
# Prints `row | WHAT | FIGURE | TARGET | yes|no` for each claim; exits 0 if all are yes.
#
# The virtual machine's processor is emulated. So a test during which the machine was too slow is tried again, and the
# cameras render a plain image. SECONDS_HELD (60) is the time without a fault; PRIORITY='chrt -r 5' keeps a busy machine
# from losing frames. Debian packages: as for in-vm.sh, v4l-utils, valgrind.
set -euo pipefail
cd "$(dirname "$0")/../.."
probe=$(readlink -f "${1:-build/release}")/tests/vm/camera_probe
[ -x "$probe" ] || { echo "$0: $probe is not built" >&2; exit 2; }
export SCRATCH=${SCRATCH:-${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm}/scratch}
mkdir -p "$SCRATCH"
out=$(mktemp "$SCRATCH/vivid.XXXXXX")
trap 'rm -f "$out"' EXIT

# These functions are defined in the virtual machine before each of the parts below.
read -r -d '' common <<'VM' || true
unplug=/sys/bus/platform/drivers/vivid
row() { echo "row | $1 | $2 | $3 | $4"; }

# Sets both cameras to the state without a fault, with a fast image; capture times are at the beginning of the exposure.
settle() {
    for d in 0 1; do
        v4l2-ctl -d$d -c percentage_of_dropped_buffers=0,wrap_sequence_number=0,wrap_timestamp=0 \
            -c osd_text_mode=2,test_pattern=5,timestamp_source=1
    done
}

# fault WHAT CODE ARGUMENTS...: causes events while the pair streams (the probe's ARGUMENTS). CODE must be reported within
# a second of the first event (`nothing`: no error may be reported), and pairs must come after the last event.
fault() {
    local what=$1 code=$2 try reported again verdict=no
    shift 2
    for try in 1 2 3; do
        settle
        echo "== $what (try $try)"
        timeout -s KILL 120 $probe "$@" > log 2>&1
        status=$?
        cat log
        reported=$(awk -F' \\| ' -v code="$code" '/^event/ { n = split($3, w, " ")
            for (i = 2; i < n; i += 2) if (w[i] == code) { print w[i + 1]; exit }
            if (!/control .* 0 \|/ && code == "nothing" && w[2] != "nothing") bad = 1 }
            END { if (code == "nothing") print bad ? "" : "0" }' log)
        again=$(awk -F' \\| ' '/^event/ { sub("again ", "", $5); last = $5 } END { print last }' log)
        leak=$(awk '/^files open/ { print $3 - $5 }' log)
        [ "$status" = 0 ] && [ "$leak" = 0 ] && [ -n "$reported" ] && awk "BEGIN { exit !($reported <= 1 && $again >= 0) }" &&
            { verdict=yes; break; }
    done
    if [ "$code" = nothing ]; then
        row "vivid: $what" "$(tail -n +1 log | awk -F' \\| ' '/^event/ { t = t " " $3 } END { print t }' | sed 's/reported//g; s/^ *//'), pairs again after ${again:-?} s" \
            "no error, pairs continue" $verdict
    else
        row "vivid: $what" "$code reported after ${reported:-?} s, pairs again after ${again:-?} s" \
            "$code within 1 s, pairs come again" $verdict
    fi
}
VM

# vm LIMIT COMMANDS: boots the virtual machine, runs COMMANDS, prints their output and appends it to $out.
vm() {
    local status=0
    LIMIT=$1 ${PRIORITY:-} tests/vm/in-vm.sh "probe='$probe'; cd \"\$(mktemp -d)\"; $common
$2" | tee -a "$out" || status=$?
    [ "$status" -eq 0 ] || echo "row | vivid: the virtual machine ran to its end | status $status | status 0 | no" | tee -a "$out"
}

held=${SECONDS_HELD:-60}
vm 1800 "
settle
for try in 1 2 3 4 5; do
    echo \"== $held s without a fault (try \$try)\"
    timeout -s KILL 180 \$probe --seconds $held > log 2>&1; cat log
    lost=\$(awk '/^(lower|upper): frames/ { gsub(\",\", \"\"); n += \$5 } END { print n }' log)
    errors=\$(awk '/^pairs/ { print \$NF }' log)
    [ \"\$lost\" = 0 ] && [ \"\$errors\" = 0 ] && break
done
frames=\$(awk '/^(lower|upper): frames/ { gsub(\",\", \"\"); print \$3 }' log | sort -n | head -1)
row 'vivid: two cameras, 640x480 at 25 Hz for $held s: lost' \"\$lost lost, \$errors errors, \$frames frames of each\" '0 lost' \$([ \"\$lost\" = 0 ] && [ \"\$errors\" = 0 ] && echo yes || echo no)
pairs=\$(awk '/^pairs/ { gsub(\",\", \"\"); print \$2 }' log)
row 'vivid: pairs' \"\$pairs\" 'at least 98 % of $held x 25' \$([ \"\$pairs\" -ge $((held * 49 / 2)) ] && echo yes || echo no)
skew=\$(awk '/^skew/ { print \$4 \" ms, at most \" \$6 \" ms\" }' log)
row 'vivid: skew of free-running cameras, median' \"\$skew\" 'at most the limit of 25 ms' \$(awk '/^skew/ { print \$6 <= 25 ? \"yes\" : \"no\" }' log)
reported=\$(grep -c 'YUYV 640 x 480 at 25 Hz$' log)
row 'vivid: size and rate that the driver reports' \"\$(sed -n 's/^lower: //p' log | head -1)\" '640 x 480 at 25 Hz, reported by the device, both' \$([ \"\$reported\" = 2 ] && echo yes || echo no)
timeout -s KILL 60 \$probe --width 320 --height 240 --seconds 2 > log 2>&1; cat log
row 'vivid: a size that the device does not have' \"\$(head -1 log)\" 'Refused, naming what it gives' \$(grep -q 'Refused.*320 x 180 pixels instead of 320 x 240' log && echo yes || echo no)
"

vm 1800 '
fault inject_vidioc_streamon_error Refused --seconds 6 --at "2 control inject_vidioc_streamon_error 1" --at "2.05 restart"
fault inject_vidioc_reqbufs_error Refused --seconds 6 --at "2 control inject_vidioc_reqbufs_error 1" --at "2.05 restart"
fault "inject_vidioc_qbuf_error (the buffer is offered again)" nothing --seconds 6 --at "2 control inject_vidioc_qbuf_error 1"
fault inject_v4l2_buf_flag_error BadData --seconds 6 --at "2 control inject_v4l2_buf_flag_error 1"
fault inject_fatal_streaming_error Disconnected --seconds 6 --hold 5 --at "2 control inject_fatal_streaming_error 1"
fault disconnect Disconnected --seconds 6 --hold 5 --at "2 control disconnect 1"
fault "percentage_of_dropped_buffers=100, then 0" Timeout --seconds 7 --at "2 control percentage_of_dropped_buffers 100" --at "4 control percentage_of_dropped_buffers 0"
fault "percentage_of_dropped_buffers=50" nothing --seconds 7 --at "2 control percentage_of_dropped_buffers 50"
lost=$(awk "/^lower: frames/ { gsub(\",\", \"\"); print \$5 }" log)
row "vivid: gaps of half the buffers are counted" "$lost lost" "at least 30 of about 62" $([ "$lost" -ge 30 ] && echo yes || echo no)
fault "wrap_sequence_number, started again" nothing --seconds 10 --at "1 control wrap_sequence_number 1" --at "1.05 restart"
lost=$(awk "/^lower: frames/ { gsub(\",\", \"\"); print \$5 }" log)
row "vivid: no loss is reported when the sequence wraps" "$lost lost" "fewer than 100" $([ "$lost" -lt 100 ] && echo yes || echo no)
for wrap in 1 2; do
    fault "wrap_timestamp=$wrap, started again" nothing --seconds 6 --at "1 control wrap_timestamp $wrap" --at "1.05 restart"
    age=$(awk "/^lower: frames/ { print \$13 }" log)
    row "vivid: age of frames with wrap_timestamp=$wrap, at most" "${age%,} ms" "less than 10000 ms" $(awk "BEGIN { a = \"${age%,}\" + 0; print (a < 10000 && a > -10000) ? \"yes\" : \"no\" }")
done
fault "unbind, and bind 2 s later" Disconnected --seconds 9 --hold 5 --at "2 write $unplug/unbind vivid.0" --at "4 write $unplug/bind vivid.0"
timeout -s KILL 60 $probe --seconds 2 --control gain=20 > log 2>&1; cat log
row "vivid: a control that an automatic control has made inactive" "$(head -1 log)" "Refused: inactive" $(grep -q "Refused.*gain is inactive" log && echo yes || echo no)
timeout -s KILL 60 $probe --seconds 2 --control gain_automatic=0 --control gain=20 --control menu=4 --control integer_64_bits=5000000000 > log 2>&1; cat log
row "vivid: controls read back" "$(head -1 log)" "gain 20, menu 4, integer_64_bits 5e+09" $(head -1 log | grep -q "gain_automatic 0, gain 20, menu 4, integer_64_bits 5e+09$" && echo yes || echo no)
'

MODULES='vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0x3,0x3 multiplanar=2,2' vm 900 '
for mode in 1 2 3; do
    fault "dv_timings_signal_mode=$mode (HDMI, planes), then 0" Timeout --seconds 7 --at "2 control dv_timings_signal_mode $mode" --at "4 control dv_timings_signal_mode 0"
    grep -m1 -o "no frame for.*" log || true
done
'

vm 1800 '
settle
timeout -s KILL 900 valgrind --leak-check=full --show-leak-kinds=definite,indirect,possible --errors-for-leak-kinds=definite,indirect,possible --error-exitcode=9 \
    $probe --width 320 --height 180 --rate 5 --max-skew 0.11 --hold 3 --seconds 30 \
    --at "8 control inject_v4l2_buf_flag_error 1" --at "12 control inject_fatal_streaming_error 1" --at "16 control disconnect 1" --at "22 restart" > log 2>&1
status=$?
cat log
# The last summary is that of the probe itself; a tracing library that comes with libcamera forks other processes.
errors=$(sed -n "s/.*ERROR SUMMARY: \([0-9]* errors\).*/\1/p" log | tail -n 1)
pairs=$(awk "/^pairs/ { gsub(\",\", \"\"); print \$2 }" log)
row "vivid: valgrind, with faults and recoveries" "${errors:-no summary}, status $status, ${pairs:-0} pairs" "0 errors, no leak, pairs" $([ $status = 0 ] && [ "${pairs:-0}" -gt 0 ] && echo yes || echo no)
'

[ "$(grep -c '^row |' "$out")" -ge 25 ] && ! grep -q '^row |.*| no$' "$out"
