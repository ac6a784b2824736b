# SPDX-License-Identifier: Apache-2.0
# Scripts that test twocone on a separate Debian source this file. It installs $suite (bookworm or trixie) with only the packages of
# debootstrap's smallest variant in the folder $root, which is removed at the end. Requires root, debootstrap, and the package mirror of
# this machine.
[ "$(id -u)" -eq 0 ] || { echo "$(basename "$0" .sh): needs root, to make a separate file system" >&2; exit 1; }

root=$(mktemp -d "${TMPDIR:-/var/tmp}/twocone_${suite}_XXXXXX")
clean_up() {
  for mount in proc dev ""; do umount -l "$root/$mount" 2>/dev/null || true; done
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT

codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
site_of() { apt-get indextargets --format '$(SITE)' "Codename: $1" 'Created-By: Packages' | head -n 1; }
mirror=$(site_of "$codename")
[ -n "$mirror" ] || { echo "$(basename "$0" .sh): this machine's apt has no mirror of $codename" >&2; exit 1; }
debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$root.log" 2>&1 || { tail -n 5 "$root.log" >&2; exit 1; }
rm -f "$root.log"
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
{
  echo "deb $mirror $suite main"
  echo "deb $mirror $suite-updates main"
  security=$(site_of "$codename-security")
  [ -z "$security" ] || echo "deb $security $suite-security main"
} >"$root/etc/apt/sources.list"
cp /etc/resolv.conf /etc/hosts "$root/etc/" 2>/dev/null || true
# A separate, private mount point, so that a test can make a mount namespace inside.
mount --bind "$root" "$root"
mount --make-rprivate "$root"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --make-rslave "$root/dev"

# in_debian COMMAND: runs a command as root of that Debian, in its folder /root
in_debian() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive ${CXX:+CXX="$CXX"} \
    ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} \
    chroot "$root" bash -c "cd /root && $1"
}
