#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs ./demo.sh twice and ./test.sh (with g++ also twice) in a fresh clone, on a Debian with only the packages of debootstrap's
# smallest variant.
#   tests/evidence/fresh_debian.sh SUITE COMPILER [DIR]
# SUITE is bookworm or trixie; COMPILER is g++ or clang++. The script writes to DIR the Debian packages that were built there.
set -euo pipefail
cd "$(dirname "$0")/../.."
suite=$1
compiler=$2
out=${3:-}
export CXX=$compiler
. tests/evidence/debian_tree.sh
git clone -q --no-hardlinks . "$root/root/twocone"
git -C "$root/root/twocone" remote remove origin
if [ "$compiler" = clang++ ]; then in_debian 'apt-get -qq update && apt-get -qq install -y --no-install-recommends clang >/dev/null'; fi

timed() { # timed NAME COMMAND
  local begin=$SECONDS
  in_debian "cd twocone && $2"
  echo "took $1: $((SECONDS - begin))"
}
echo "begin demo"
timed 'first demo' ./demo.sh
echo "end demo"
timed 'second demo' './demo.sh --frames 10'
timed 'first test' ./test.sh
if [ "$compiler" = g++ ]; then timed 'second test' ./test.sh; fi
echo "compiler: $(in_debian '$CXX --version' | head -n 1)"
if [ -n "$out" ]; then
  in_debian 'cd twocone/build/release && cpack' | tail -n 1
  mkdir -p "$out"
  cp "$root"/root/twocone/build/release/*.deb "$out/"
fi
