#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ./demo.sh and ./test.sh, each twice, on a Debian 12 that holds nothing but what debootstrap's smallest variant brings, in a fresh clone.
# Needs root, and the package mirror that this machine itself is set up with.
set -euo pipefail
cd "$(dirname "$0")/../.."
[ "$(id -u)" -eq 0 ] || { echo "fresh_debian: needs root, to make a file system of its own" >&2; exit 1; }

root=$(mktemp -d "${TMPDIR:-/var/tmp}/twocone_debian_XXXXXX")
clean_up() {
  for mount in proc dev ""; do umount -l "$root/$mount" 2>/dev/null || true; done
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT

mirror=$(apt-get indextargets --format '$(SITE)' 'Codename: bookworm' 'Created-By: Packages' | head -n 1)
[ -n "$mirror" ] || { echo "fresh_debian: this machine's apt knows no mirror of bookworm" >&2; exit 1; }
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1 || { tail -n 5 "$root.log" >&2; exit 1; }
rm -f "$root.log"
rm -f "$root/etc/apt/sources.list"  # debootstrap's own: this machine's set-up names the same mirror
cp -r /etc/apt/. "$root/etc/apt/"
cp /etc/resolv.conf /etc/hosts "$root/etc/" 2>/dev/null || true
# A mount point of its own and nobody's peer, so that a test may make a mount namespace inside.
mount --bind "$root" "$root"
mount --make-rprivate "$root"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --make-rslave "$root/dev"
git clone -q --no-hardlinks . "$root/root/twocone"
git -C "$root/root/twocone" remote remove origin

in_debian() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 \
    ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} \
    chroot "$root" bash -c "cd /root/twocone && $1"
}
timed() { # timed NAME COMMAND
  local begin=$SECONDS
  in_debian "$2"
  echo "took $1: $((SECONDS - begin))"
}
echo "begin demo"
timed 'first demo' ./demo.sh
echo "end demo"
timed 'second demo' './demo.sh --frames 10'
timed 'first test' ./test.sh
timed 'second test' ./test.sh
