#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# stop.sh [BUILD_DIR] [COUNT] - `twocone run` drives with two virtual cameras and an emulated controller at a virtual
# serial port. With each protocol, at COUNT random moments each, it is killed, halted, and loses its cameras; then it is
# killed together with its watchdog. The emulator logs when its wheels stop. PROTOCOLS and DEEDS select some of these.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=$(readlink -f "${1:-build/release}")
count=${2:-20}
protocols=${PROTOCOLS:-ros_arduino_bridge roboclaw create2}
deeds=${DEEDS:-kill halt unplug watchdog}
for program in twocone tests/vm/stop_trial tests/emulator/emulated_controller; do
    [ -x "$build/$program" ] || { echo "stop.sh: $build/$program is not built" >&2; exit 2; }
done

inner="
set -e
bash $PWD/tests/vm/acm.sh
mkdir -p /tmp/stop && cd /tmp/stop
worst=0
for protocol in $protocols; do
    sed -e \"s/protocol: PROTOCOL.*/protocol: \$protocol/\" -e 's|\\.\\./\\.\\./\\.\\.|$PWD|' $PWD/tests/vm/robots/stop.yaml > \$protocol.yaml
    [ \$protocol != create2 ] || sed -i '/counts_per_turn/d' create2.yaml
    mkfifo \$protocol.in
    $build/tests/emulator/emulated_controller \$protocol /dev/ttyGS0 <> \$protocol.in > \$protocol.log &
    emulator=\$!
    for deed in $deeds; do
        n=$count
        [ \$deed != watchdog ] || n=\$(( $count < 3 ? $count : 3 ))
        $build/tests/vm/stop_trial \$protocol \$deed \$n 7 1.0 \$protocol.log \\
            $build/twocone run --robot \$protocol.yaml --frames 100000 --method paper > trial.log 2>&1 || worst=1
        grep -a -E '^(row|[a-z0-9_]+, |a watchdog|the |frame|drive|twocone)' trial.log || true
        grep -a -q '^row' trial.log || { echo 'its last lines:'; tail -n 8 trial.log; }
        rm -rf runs
    done
    kill \$emulator; wait \$emulator 2>/dev/null || true
done
exit \$worst
"
LIMIT=${LIMIT:-3000} CPUS=${CPUS:-2} MEMORY=${MEMORY:-1536} \
MODULES=$'vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0x3,0x3 multiplanar=1,1\ndummy_hcd\nlibcomposite\nusb_f_acm\ncdc_acm' \
    tests/vm/in-vm.sh "$inner" | sed -u 's|\r||'
