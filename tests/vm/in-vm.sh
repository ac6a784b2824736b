#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# in-vm.sh 'COMMAND' - runs COMMAND as root in a virtual machine whose kernel has
# the virtual camera drivers (vivid: /dev/video0 and /dev/video1).
#
# The virtual machine sees this machine's / (it reads from it; its writes are lost at
# the end) and the folder $SCRATCH under the same path, shared and writable. The script
# prints the output of COMMAND and exits with its status; 124 = not finished within
# $LIMIT seconds, 125 = the virtual machine did not start.
#
# Debian packages: qemu-system-x86 busybox-static cpio kmod udev, and, downloaded but
# not installed, linux-image-amd64 (Debian's cloud kernel has no video drivers).
#
# Settings (environment): HWLAB (the folder of the kernel), SCRATCH, LIMIT, CPUS, MEMORY, MODULES and DEVICES (see below),
# ACCEL, VERBOSE=1 (messages of the virtual machine's kernel, in $SCRATCH/.console).
set -euo pipefail

lab=${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm}   # kernel and initramfs are kept here
mkdir -p "$lab"
SCRATCH=$(readlink -f "${SCRATCH:-$lab/scratch}")
LIMIT=${LIMIT:-300} CPUS=${CPUS:-1} MEMORY=${MEMORY:-1024} ACCEL=${ACCEL:-tcg}
# MODULES has one module per line, with its options; a line that starts with / is a .ko file.
# DEVICES adds devices as options of qemu: e.g. a serial port /dev/ttyUSB0 whose other end is a pty on this machine:
#   DEVICES='-device qemu-xhci -chardev serial,id=motor,path=/dev/pts/3 -device usb-serial,chardev=motor'
DEVICES=${DEVICES:-}
MODULES=${MODULES-'vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0x0,0x0 multiplanar=1,1'}

fetch_kernel() {          # -> $lab/kernel/{boot,lib/modules}
    local name
    name=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: //p')
    mkdir -p "$lab/kernel"
    (cd "$lab/kernel" && apt-get -q download "$name" && dpkg-deb -x "$name"_*.deb . && rm "$name"_*.deb)
    depmod -b "$lab/kernel" "$(ls "$lab/kernel/lib/modules")"
}

build_initramfs() {       # contains only the programs and modules to mount this machine's / over 9p
    local root name
    root=$(mktemp -d)
    mkdir -p "$root"/{bin,dev,proc,sys,low,rw,new,mod}
    cp /bin/busybox "$root/bin/busybox"
    for name in virtio_pci 9pnet_virtio 9p overlay; do
        modprobe -d "$lab/kernel" -S "$version" --show-depends "$name"
    done | awk '!seen[$2]++ { print $2 }' | while read -r ko; do
        cp "$ko" "$root/mod/"
        echo "insmod /mod/${ko##*/}"
    done > "$root/load"
    cat > "$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
. /load
mount -t tmpfs tmpfs /rw; mkdir /rw/up /rw/work
opt=trans=virtio,version=9p2000.L,msize=512000
mount -t 9p -o $opt,ro,cache=loose host /low
mount -t overlay -o lowerdir=/low,upperdir=/rw/up,workdir=/rw/work root /new
for d in proc sys dev; do mount --move /$d /new/$d; done
mount -t tmpfs tmpfs /new/run; mount -t tmpfs tmpfs /new/dev/shm 2>/dev/null || {
    mkdir -p /new/dev/shm; mount -t tmpfs tmpfs /new/dev/shm; }
mkdir -p /new/dev/pts; mount -t devpts devpts /new/dev/pts
scratch=$(sed 's/.* scratch=\([^ ]*\).*/\1/' /new/proc/cmdline)
mkdir -p "/new$scratch"; mount -t 9p -o $opt,cache=none scratch "/new$scratch"
exec switch_root /new /bin/bash "$scratch/.vm"
INIT
    chmod +x "$root/init"
    (cd "$root" && find . | cpio -o -H newc --quiet | gzip -1) > "$lab/initramfs.gz"
    rm -r "$root"
}

[ $# -eq 1 ] || { echo "usage: $0 'COMMAND'" >&2; exit 2; }
mkdir -p "$SCRATCH"
[ -d "$lab/kernel/lib/modules" ] || fetch_kernel
version=$(ls "$lab/kernel/lib/modules")
[ "$lab/initramfs.gz" -nt "$0" ] || build_initramfs

# The virtual machine runs this script once it has this machine's files; ttyS1 is our standard output.
# COMMAND itself is not quoted into it but read from a file.
printf '%s\n' "$1" > "$SCRATCH/.command"
printf '%s\n' "$MODULES" > "$SCRATCH/.modules"
cat > "$SCRATCH/.vm" <<VM
cd '$SCRATCH'
stty -F /dev/ttyS1 raw -echo
exec > /dev/ttyS1 2>&1 < /dev/null
mkdir -p /lib/modules && mount --bind '$lab/kernel/lib/modules' /lib/modules
ip link set lo up 2>/dev/null
/lib/systemd/systemd-udevd --daemon 2>/dev/null
while read -r module; do
    case \$module in
        '') ;;
        /*) insmod \$module ;;
        *) modprobe \$module ;;
    esac || { echo "in-vm: cannot load \$module"; echo 125 > .status; }
done < .modules
udevadm trigger --subsystem-match=tty; udevadm settle
[ -e .status ] || { bash .command; echo \$? > .status; }
sleep 60 &
sync
echo o > /proc/sysrq-trigger
wait
VM
rm -f "$SCRATCH/.status"

status=0
timeout -k 5 "$LIMIT" qemu-system-x86_64 -M q35,accel="$ACCEL" -cpu max -smp "$CPUS" -m "$MEMORY" \
    -nodefaults -display none -no-reboot \
    -kernel "$lab"/kernel/boot/vmlinuz-"$version" -initrd "$lab/initramfs.gz" \
    -append "console=ttyS0 ${VERBOSE:+loglevel=7} ${VERBOSE:-quiet} panic=-1 mitigations=off nokaslr scratch=$SCRATCH" \
    -virtfs local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap \
    -virtfs local,path="$SCRATCH",mount_tag=scratch,security_model=none \
    -serial file:"$SCRATCH/.console" -serial stdio $DEVICES < /dev/null || status=$?
[ "$status" -ne 124 ] || { echo "in-vm: not finished within $LIMIT s" >&2; exit 124; }
[ -s "$SCRATCH/.status" ] || { echo "in-vm: the virtual machine did not start, see $SCRATCH/.console" >&2; exit 125; }
exit "$(cat "$SCRATCH/.status")"
