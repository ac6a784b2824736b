#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds cmake/Containerfile by buildah and runs three frames in the image. The base image is a Debian that debootstrap makes, because a
# registry of images need not be reachable.
#   tests/evidence/release/container.sh SOURCE_TARBALL
set -euo pipefail
cd "$(dirname "$0")/../../.."
tarball=$(realpath "$1")
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
. tests/evidence/debian_tree.sh
# Without privileges for namespaces and overlays: everything in a folder, in a chroot.
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot
store=$(mktemp -d "${TMPDIR:-/var/tmp}/twocone_images_XXXXXX")
build() { buildah --root "$store/root" --runroot "$store/run" "$@"; }
end() {
  build rm --all >/dev/null 2>&1 || true
  rm -rf --one-file-system "$store"
  clean_up
}
trap end EXIT
umount -l "$root/proc" "$root/dev" "$root"
base=$(build from scratch)
tar -C "$root" --one-file-system -c . | tar -C "$(build mount "$base")" -x
build unmount "$base" >/dev/null
build commit -q "$base" localhost/debian >/dev/null
tar -xzf "$tarball" -C "$store"
build bud --pull-never --network host --build-arg BASE=localhost/debian -f cmake/Containerfile -t localhost/twocone "$store"/twocone-*/
made=$(build from --pull-never localhost/twocone)
build run "$made" -- twocone run --robot /usr/share/twocone/robots/lab_sim.yaml --frames 3 --out /tmp/run | grep -E '^fix'
