#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# build-vimc.sh - builds vimc.ko for the kernel of in-vm.sh (Debian does not ship it), from Debian's own kernel source.
# Debian packages: linux-headers-<version> (installed), linux-source-6.1 (downloaded only). Then:
#   MODULES='vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0x0,0x0
#   vimc' tests/vm/in-vm.sh 'cam -l'          (needs libcamera-tools and libcamera-ipa)
set -euo pipefail
lab=${HWLAB:-${XDG_CACHE_HOME:-$HOME/.cache}/twocone-vm}   # as in in-vm.sh; run that once before
version=$(ls "$lab/kernel/lib/modules")
work=$(mktemp -d)
cd "$work"
apt-get -q download linux-source-6.1
dpkg-deb -x linux-source-6.1_*.deb .
tar xJf usr/src/linux-source-6.1.tar.xz --wildcards 'linux-source-6.1/drivers/media/test-drivers/vimc/*'
make -C "/usr/src/linux-headers-$version" M="$work/linux-source-6.1/drivers/media/test-drivers/vimc" CONFIG_VIDEO_VIMC=m modules
install -D linux-source-6.1/drivers/media/test-drivers/vimc/vimc.ko "$lab/kernel/lib/modules/$version/updates/vimc.ko"
depmod -b "$lab/kernel" "$version"
rm -r "$work"
