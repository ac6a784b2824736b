#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests the Debian package: makes it with cpack or takes one that exists, installs it on a Debian with only the packages of debootstrap's
# smallest variant, runs the program there, and removes the package.
#   tests/evidence/deb.sh [BUILD_DIR]       makes the package of BUILD_DIR (default build/release, with twocone built), for this Debian
#   tests/evidence/deb.sh SUITE DIR         tests the package that tests/evidence/fresh_debian.sh has written to DIR, on SUITE
# Prints lines `row | WHAT | FIGURE | TARGET | yes|no`; exits 0 only if all are yes.
set -euo pipefail
cd "$(dirname "$0")/../.."
if (($# == 2)); then
  suite=$1
  build=$(realpath "$2")
else
  suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
  build=$(realpath "${1:-build/release}")
  [ -x "$build/twocone" ] || { echo "deb: $build/twocone is not built" >&2; exit 1; }
fi

unmet=0
row() { # row WHAT FIGURE TARGET yes|no
  [ "$4" = yes ] || unmet=$((unmet + 1))
  echo "row | $1 | $2 | $3 | $4"
}
same() { [ "$1" = "$2" ] && echo yes || echo no; }
sha_of() { sha256sum "$1" | cut -c1-64; }

if (($# == 2)); then
  built=$(cat "$build/twocone.sha256")
else
  built=$(sha_of "$build/twocone")
  rm -f "$build"/twocone_*.deb
  (cd "$build" && cpack) | tail -n 1
fi
version=$(sed -n 's/^project(twocone VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
deb=$build/twocone_${version}_$(dpkg --print-architecture).deb
row "package made by cpack" "$(basename "$deb" .deb), $(($(stat -c %s "$deb") / 1024)) KiB" "twocone_VERSION_ARCHITECTURE.deb" "$([ -f "$deb" ] && echo yes || echo no)"
if command -v lintian >/dev/null; then
  findings=$(lintian --fail-on none "$deb" 2>/dev/null | grep -c '^[EW]:' || true)
  row "lintian's errors and warnings, beyond those overridden with a reason" "$findings" "0" "$(same "$findings" 0)"
else
  echo "lintian is not installed: the package is not checked"
fi

. tests/evidence/debian_tree.sh
cp "$deb" "$root/root/twocone.deb"
echo 'APT::Sandbox::User "root";' >"$root/etc/apt/apt.conf.d/99deb-evidence" # the user _apt cannot read /root
in_debian 'apt-get -qq update && apt-get -qq install -y man-db >/dev/null 2>&1'
# The recommended packages are installed too, because simulation needs POV-Ray; those that POV-Ray recommends are not.
in_debian 'apt-get -qq install -y --no-install-recommends ./twocone.deb povray povray-includes' >"$build/deb-install.log" 2>&1 && installed=yes || installed=no
row "installs on a fresh Debian ($suite)" "$(in_debian 'dpkg-query -W -f "\${db:Status-Status}" twocone' 2>&1)" "installed" "$installed"
row "the installed binary is the built and tested one" "sha256 $(sha_of "$root/usr/bin/twocone" | cut -c1-16)" "${built:0:16}" "$(same "$(sha_of "$root/usr/bin/twocone")" "$built")"
row "twocone --version there" "$(in_debian 'twocone --version')" "twocone $version" "$(same "$(in_debian 'twocone --version' | awk '{ print $2 }')" "$version")"

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
