#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The Debian package: made by cpack, installed on a Debian 12 that holds nothing but what debootstrap's smallest variant brings,
# tried there, and removed again.
#   tests/evidence/deb.sh [BUILD_DIR]       default: build/release, with twocone built. Needs root, and debootstrap.
# Prints lines `row | WHAT | FIGURE | TARGET | yes|no`; exits 0 only if all are yes.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(realpath "${1:-build/release}")
[ "$(id -u)" -eq 0 ] || { echo "deb: needs root, to make a file system of its own" >&2; exit 1; }
[ -x "$build/twocone" ] || { echo "deb: $build/twocone is not built" >&2; exit 1; }

unmet=0
row() { # row WHAT FIGURE TARGET yes|no
  [ "$4" = yes ] || unmet=$((unmet + 1))
  echo "row | $1 | $2 | $3 | $4"
}
same() { [ "$1" = "$2" ] && echo yes || echo no; }
sha_of() { sha256sum "$1" | cut -c1-64; }

built=$(sha_of "$build/twocone")
rm -f "$build"/twocone_*.deb
(cd "$build" && cpack) | tail -n 1
version=$("$build/twocone" --version | awk '{ print $2 }')
deb=$build/twocone_${version}_$(dpkg --print-architecture).deb
row "package made by cpack" "$(basename "$deb" .deb), $(($(stat -c %s "$deb") / 1024)) KiB" "twocone_VERSION_ARCHITECTURE.deb" "$([ -f "$deb" ] && echo yes || echo no)"
if command -v lintian >/dev/null; then
  complaints=$(lintian --fail-on none "$deb" 2>/dev/null | grep -c '^[EW]:' || true)
  row "lintian's errors and warnings, beyond those overridden with a reason" "$complaints" "0" "$(same "$complaints" 0)"
else
  echo "lintian is not installed: the package is not looked over"
fi

root=$(mktemp -d "${TMPDIR:-/var/tmp}/twocone_deb_XXXXXX")
clean_up() {
  for mount in proc dev; do umount -l "$root/$mount" 2>/dev/null || true; done
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
mirror=$(apt-get indextargets --format '$(SITE)' 'Codename: bookworm' 'Created-By: Packages' | head -n 1)
[ -n "$mirror" ] || { echo "deb: this machine's apt knows no mirror of bookworm" >&2; exit 1; }
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1 || { tail -n 5 "$root.log" >&2; exit 1; }
rm -f "$root.log"
rm -f "$root/etc/apt/sources.list" # debootstrap's own: this machine's set-up names the same mirror
cp -r /etc/apt/. "$root/etc/apt/"
cp /etc/resolv.conf /etc/hosts "$root/etc/" 2>/dev/null || true
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --make-rslave "$root/dev"
cp "$deb" "$root/root/twocone.deb"
in_debian() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} \
    chroot "$root" bash -c "cd /root && $1"
}

echo 'APT::Sandbox::User "root";' >"$root/etc/apt/apt.conf.d/99deb-evidence" # /root is closed to _apt
in_debian 'apt-get -qq update && apt-get -qq install -y man-db >/dev/null 2>&1'
# With what it recommends: POV-Ray is what simulates. Without gnuplot's and POV-Ray's own recommendations.
in_debian 'apt-get -qq install -y --no-install-recommends ./twocone.deb povray povray-includes gnuplot-nox' >"$build/deb-install.log" 2>&1 && installed=yes || installed=no
row "installs on a fresh Debian 12" "$(in_debian 'dpkg-query -W -f "\${db:Status-Status}" twocone' 2>&1)" "installed" "$installed"
row "the installed binary is the one that was built and tested" "sha256 $(sha_of "$root/usr/bin/twocone" | cut -c1-16)" "${built:0:16}" "$(same "$(sha_of "$root/usr/bin/twocone")" "$built")"
row "twocone --version there" "$(in_debian 'twocone --version')" "as here" "$(same "$(in_debian 'twocone --version')" "$("$build/twocone" --version)")"

in_debian 'twocone run --robot /usr/share/twocone/robots/lab_sim.yaml --frames 3 --out /tmp/x' || true
fixes=$(awk -F, 'FNR > 1 && $3 == "ok"' "$root/tmp/x/fixes.csv" 2>/dev/null | wc -l)
row "three frames of /usr/share/twocone/robots/lab_sim.yaml, fixes" "$fixes" "3" "$(same "$fixes" 3)"
in_debian 'twocone report /tmp/x >/dev/null' && reported=yes || reported=no
row "their report" "$([ -f "$root/tmp/x/report.html" ] && echo report.html || echo none)" "report.html" "$reported"

in_debian 'mkdir robot && cp -r /usr/share/twocone/robots /usr/share/twocone/scenes robot/ &&
  twocone run --robot robot/robots/create2_sim.yaml --frames 1 --out /tmp/y >/dev/null' && copied=yes || copied=no
row "a robot file copied with both folders" "$copied" "runs" "$copied"

words=$(in_debian 'man twocone 2>&1' | col -b)
missing=""
for command in run localise report serve effects calibrate devices doctor; do
  grep -q "^ *twocone $command" <<<"$words" || missing+=" $command"
done
row "man twocone names every subcommand; missing" "${missing:-none}" "none" "$([ -z "$missing" ] && echo yes || echo no)"
warnings=$(MANWIDTH=80 LC_ALL=C.UTF-8 man --warnings -l docs/twocone.1 2>&1 >/dev/null | wc -l)
row "warnings of the man page's formatter" "$warnings" "0" "$(same "$warnings" 0)"

in_debian 'apt-get -qq purge -y twocone >/dev/null 2>&1' || true
left=$(cd "$root" && find usr etc -path "*twocone*" | wc -l)
row "files left after a purge" "$left" "0" "$(same "$left" 0)"
exit $((unmet != 0))
