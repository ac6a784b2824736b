#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# build-v4l2loopback.sh - builds v4l2loopback.ko for the kernel of in-vm.sh, from Debian's v4l2loopback-dkms. Then:
#   MODULES='v4l2loopback devices=2 video_nr=10,11 exclusive_caps=1,1' tests/vm/in-vm.sh '...'
# gives /dev/video10 and /dev/video11: one program writes images into them (feed_images.cpp), another captures them.
# Debian packages: linux-headers-<version of that kernel> (installed), v4l2loopback-dkms (downloaded only).
set -euo pipefail
lab=${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm}   # as in in-vm.sh; run that once before
version=$(ls "$lab/kernel/lib/modules")
work=$(mktemp -d)
cd "$work"
apt-get -q download v4l2loopback-dkms
dpkg-deb -x v4l2loopback-dkms_*.deb .
make -C "/usr/src/linux-headers-$version" M="$(echo "$work"/usr/src/v4l2loopback-*)" modules
install -D usr/src/v4l2loopback-*/v4l2loopback.ko "$lab/kernel/lib/modules/$version/updates/v4l2loopback.ko"
depmod -b "$lab/kernel" "$version"
rm -r "$work"
