#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# loopback.sh [BUILD_DIR] - what a served world's cameras see, through devices of v4l2loopback. In the virtual machine,
# `twocone serve --v4l2-loopback` writes, `twocone run` drives an attached robot, and captured_images captures by the driver of
# V4L2 cameras. The images that it captures are compared with those of the run.
# FRAMES, default 100. Other settings: those of in-vm.sh.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(readlink -f "${1:-build/release}")
lab=${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm}
export SCRATCH=${SCRATCH:-$lab/scratch}
mkdir -p "$SCRATCH"
SCRATCH=$(readlink -f "$SCRATCH")
frames=${FRAMES:-100}
robot=$PWD/tests/vm/robots/loop_sim.yaml
if ! find "$lab"/kernel/lib/modules/*/updates -name v4l2loopback.ko 2> /dev/null | grep -q .; then
    MODULES='' tests/vm/in-vm.sh true # this fetches the kernel
    headers=linux-headers-$(ls "$lab/kernel/lib/modules")
    dpkg -s "$headers" > /dev/null 2>&1 || apt-get -q install -y "$headers"
    tests/vm/build-v4l2loopback.sh > /dev/null
fi
work=$(mktemp -d "$SCRATCH/loopback.XXXXXX")
trap 'rm -rf "$work"' EXIT
cat > "$work/in_vm" <<VM
export XDG_RUNTIME_DIR=/run
cd /run
'$build/twocone' serve --scene '$PWD/scenes/lab.map.yaml' --renderer native --v4l2-loopback lower=/dev/video10 \
    --v4l2-loopback robot.lab.upper=/dev/video11 > /run/serve 2>&1 &
server=\$!
until grep -qs serving /run/serve; do
    kill -0 \$server || { cat /run/serve; exit 1; }
    sleep 0.2
done
echo "the world is served"
# A first frame sets the devices' sizes; the programs that capture start then, and capture it too.
drive() { '$build/twocone' run --robot '$robot' --set attach=lab --renderer native --behaviour wander --seed 1 "\$@" 2>&1 | tail -n 2; }
drive --frames 1 --out /run/first
capturing=
for view in lower:10 upper:11; do
    '$build/tests/vm/captured_images' capture /dev/video\${view#*:} 320 240 2 $((frames + 1)) /run/\${view%:*}.rgb > /run/\${view%:*} 2>&1 &
    capturing+=" \$!"
done
for view in lower upper; do
    until grep -qs capturing /run/\$view; do
        grep -s captured_images /run/\$view && cat /run/serve && exit 1
        sleep 0.2
    done
done
echo "both programs capture"
drive --real-time --frames $((frames + 10)) --out /run/whole
wait \$capturing
cat /run/serve /run/lower /run/upper
for view in lower upper; do
    echo "\$view \$('$build/tests/vm/captured_images' compare /run/\$view.rgb 320 240 /run/whole \$view)"
done
VM
CPUS=${CPUS:-2} LIMIT=${LIMIT:-900} MODULES='v4l2loopback devices=2 max_buffers=6 video_nr=10,11 exclusive_caps=1,1' \
    tests/vm/in-vm.sh ". '$work/in_vm'" | tee "$work/out" || true
failed=0
for view in lower upper; do
    equal=$(sed -n "s/^$view equal \([0-9]*\) of.*/\1/p" "$work/out")
    met=$([ "${equal:-0}" -ge "$frames" ] && echo yes || echo no)
    echo "row | loopback: frames of view $view that another program captured equal, of $frames | ${equal:-none} | $frames | $met"
    [ "$met" = yes ] || failed=1
done
exit $failed
