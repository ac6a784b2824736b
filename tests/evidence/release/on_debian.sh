#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs packages on a Debian with only the packages of debootstrap's smallest variant, runs what they hold, upgrades from an earlier
# package, and removes them.
#   tests/evidence/release/on_debian.sh FOLDER_OF_PACKAGES VERSION [EARLIER_PACKAGE]
# On the Debian of this machine, or SUITE=trixie. Prints lines `row | WHAT | FIGURE | TARGET | yes|no`; exits 0 only if all are yes.
set -euo pipefail
cd "$(dirname "$0")/../../.."
packages=$(realpath "$1")
version=$2
earlier=${3:-}
suite=${SUITE:-$(. /etc/os-release && echo "$VERSION_CODENAME")}
unmet=0
row() { # row WHAT FIGURE TARGET yes|no
  [ "$4" = yes ] || unmet=$((unmet + 1))
  echo "row | $1 | $2 | $3 | $4"
}
same() { [ "$1" = "$2" ] && echo yes || echo no; }
. tests/evidence/debian_tree.sh
mkdir "$root/root/packages" "$root/root/earlier"
cp "$packages"/*.deb "$root/root/packages"
echo 'APT::Sandbox::User "root";' >"$root/etc/apt/apt.conf.d/99deb-evidence" # the user _apt cannot read /root
in_debian 'apt-get -qq update && apt-get -qq install -y man-db bash-completion >/dev/null 2>&1'
# Files that a package leaves, beside those of the system.
ours() { (cd "$root" && find usr etc var/lib -path '*twocone*' ! -path 'var/lib/apt/*' | sort); }
states() { in_debian 'dpkg-query -W -f "\${Package} \${Version} \${db:Status-Status}\n" "*twocone*" 2>/dev/null' | awk '$3 == "installed" { print $1 "_" $2 }' | paste -sd' '; }

# Recommended packages are installed, as `apt install` does by default; those that they recommend are not of interest.
in_debian 'apt-get -qq install -y --no-install-recommends ./packages/*.deb povray povray-includes >/dev/null 2>install.log' && installed=yes || installed=no
row "apt install ./*.deb on a fresh Debian ($suite)" "$(states)" "5 packages of $version" "$([ "$(states | wc -w)" = 5 ] && echo "$installed" || echo no)"
row "twocone --version there" "$(in_debian 'twocone --version')" "twocone $version" "$(same "$(in_debian 'twocone --version' | awk '{ print $2 }')" "$version")"
examples=/usr/share/doc/python3-twocone/examples
for example in 'paper_experiment.py --frames 60 --out /tmp/paper' 'own_controller.py --frames 90' 'robot_as_built.py --out /tmp/built'; do
  in_debian "cd /tmp && timeout 900 python3 $examples/$example" >"$root/tmp/example.log" 2>&1 && ran=yes || ran=no
  row "example $example" "$(tail -n 1 "$root/tmp/example.log" | cut -c1-120)" "runs" "$ran"
done
missing=$(in_debian 'for command in $(twocone --help | sed -n "/^Subcommands:/,\$ s/^  \([a-z][-a-z]*\) .*/\1/p"); do man -w twocone-$command >/dev/null 2>&1 || echo $command; done' | paste -sd' ')
row "subcommands without a man page" "${missing:-none}" "none" "$([ -z "$missing" ] && echo yes || echo no)"
completed=$(in_debian '. /usr/share/bash-completion/bash_completion; . /usr/share/bash-completion/completions/twocone; compopt() { :; }; COMP_WORDS=(twocone run --beh); COMP_CWORD=2; _twocone; echo "${COMPREPLY[*]}"')
row "completion of 'twocone run --beh'" "$completed" "--behaviour" "$(same "$completed" --behaviour)"
in_debian 'apt-get -qq install -y --no-install-recommends g++ cmake make pkg-config >/dev/null 2>&1; cat >p.cpp <<END
#include <twocone/localisation.h>
#include <vector>
int main() {
  const std::vector<twocone::LandmarkObservation> seen{{3, 0, 3, 0, 0.01, 0.01}, {0, 4, 4, 1.5707963, 0.01, 0.01}};
  return twocone::locate(seen).pose ? 0 : 1;
}
END
g++ -std=c++20 p.cpp $(pkg-config --cflags --libs twocone_localisation) -o p && ./p' >"$root/tmp/cpp.log" 2>&1 && cpp=yes || cpp=no
row "a C++ program, built with libtwocone-dev" "$cpp" "runs" "$cpp"

in_debian 'apt-get -qq purge -y "*twocone*" >/dev/null 2>&1' || true
left=$(ours | wc -l)
row "files left after a purge" "$left $(ours | head -n 3 | paste -sd' ')" "0" "$(same "$left" 0)"

if [ -n "$earlier" ]; then
  cp "$earlier" "$root/root/earlier"
  in_debian 'apt-get -qq install -y --no-install-recommends ./earlier/*.deb >/dev/null 2>&1' || true
  had=$(states)
  in_debian 'twocone run --robot /usr/share/twocone/robots/lab_sim.yaml --frames 3 --out /tmp/before' >/dev/null 2>&1 || true
  in_debian 'apt-get -qq install -y --no-install-recommends ./packages/*.deb >/dev/null 2>upgrade.log' && upgraded=yes || upgraded=no
  row "upgrade from $had" "$(states)" "5 packages of $version" "$([ "$(states | wc -w)" = 5 ] && echo "$upgraded" || echo no)"
  in_debian 'twocone localise /tmp/before >/dev/null && twocone report /tmp/before >/dev/null' && read=yes || read=no
  row "a run folder that 0.1 wrote, localised and reported by $version" "$read" "yes" "$read"
  in_debian 'apt-get -qq purge -y "*twocone*" >/dev/null 2>&1' || true
  row "files left after a purge of the upgraded packages" "$(ours | wc -l)" "0" "$(same "$(ours | wc -l)" 0)"
fi
exit $((unmet != 0))
