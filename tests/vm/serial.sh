#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# serial.sh [BUILD_DIR] - tests the serial drive with real kernel ports and all three protocols: an emulated FTDI adapter
# whose far end is a pseudo-terminal on this machine, and a CDC-ACM port with both ends in the virtual machine.
# drive_probe.cpp defines the tests. PROTOCOLS and PORTS (ftdi, acm) select some of them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=$(readlink -f "${1:-build/release}")
protocols=${PROTOCOLS:-ros_arduino_bridge roboclaw create2}
ports=${PORTS:-ftdi acm}
emulator=$build/tests/emulator/emulated_controller
probe=$build/tests/vm/drive_probe
for program in "$emulator" "$probe"; do
    [ -x "$program" ] || { echo "serial.sh: $program is not built" >&2; exit 2; }
done
lab=${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm}
export SCRATCH=${SCRATCH:-$lab/scratch} LIMIT=${LIMIT:-900}
mkdir -p "$SCRATCH"
SCRATCH=$(readlink -f "$SCRATCH")
worst=0

# Each protocol gets its own virtual machine, because the pseudo-terminal is one of its devices.
ftdi() {
    local protocol=$1 here children pty status=0
    here=$SCRATCH/ftdi-$protocol
    rm -rf "$here" && mkdir -p "$here" && : > "$here/commands"
    # With a FIFO the script knows both processes and ends them: a tail that follows an empty file would not notice that
    # the emulator has ended.
    mkfifo "$here/in"
    "$emulator" "$protocol" pty < "$here/in" > "$here/log" &
    children=$!
    tail -n +1 -s 0.1 -f "$here/commands" > "$here/in" &
    children="$! $children"
    for _ in $(seq 50); do grep -q '^pty' "$here/log" && break; sleep 0.1; done
    pty=$(sed -n 's/^pty //p' "$here/log")
    DEVICES="-device qemu-xhci -chardev serial,id=motor,path=$pty -device usb-serial,chardev=motor" \
    MODULES=$'xhci_pci\nftdi_sio' tests/vm/in-vm.sh "
        for i in \$(seq 50); do [ -e /dev/ttyUSB0 ] && break; sleep 0.2; done
        $probe $protocol /dev/ttyUSB0 $here/log $here/commands \
            'echo 0 > /sys/bus/usb/devices/1-1/authorized' 'echo 1 > /sys/bus/usb/devices/1-1/authorized'" || status=$?
    kill $children 2>/dev/null || true
    wait $children 2>/dev/null || true
    return $status
}

acm() {
    MODULES=$'dummy_hcd\nlibcomposite\nusb_f_acm\ncdc_acm' tests/vm/in-vm.sh "
        bash $PWD/tests/vm/acm.sh
        mkdir -p /tmp/acm && cd /tmp/acm
        udc=/sys/kernel/config/usb_gadget/g/UDC
        worst=0
        for protocol in $protocols; do
            : > \$protocol.commands
            tail -n +1 -s 0.1 -f \$protocol.commands | $emulator \$protocol /dev/ttyGS0 > \$protocol.log &
            $probe \$protocol /dev/ttyACM0 \$protocol.log \$protocol.commands \
                \"echo '' > \$udc\" \"echo dummy_udc.0 > \$udc\" || worst=1
            kill \$!  # the emulator; its tail ends with the virtual machine
        done
        exit \$worst"
}

for port in $ports; do
    if [ "$port" = acm ]; then
        acm | sed -u -e 's|\r||' -e 's/^row | /row | CDC-ACM, /' || worst=1
    else
        for protocol in $protocols; do
            ftdi "$protocol" | sed -u -e 's|\r||' -e 's/^row | /row | FTDI, /' || worst=1
        done
    fi
done
exit $worst
