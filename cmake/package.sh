#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes a release of the present commit: the source as a tarball, and of that tarball the Debian packages. The same commit on
# the same Debian gives the same bytes.
#   cmake/package.sh [FOLDER]      default: build/packages
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:-build/packages}")
changes=$(git status --porcelain --untracked-files=no)
if [ -n "$changes" ]; then
  echo "package.sh: a release is of a commit, and these files differ from it:" >&2
  echo "$changes" >&2
  exit 1
fi
cmake/setup.sh
version=$(sed -n 's/^project(twocone VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
name=twocone-$version
mkdir -p "$out"
rm -f "$out"/twocone-*.tar.gz "$out"/{twocone,twocone-rosbag,libtwocone*,python3-twocone}_*.deb
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
git archive --format=tar --prefix="$name/" HEAD | gzip -9n >"$out/$name.tar.gz"
tar -xzf "$out/$name.tar.gz" -C "$work"

build=$work/build
cmake --preset release -S "$work/$name" -B "$build" -D TWOCONE_BUILD_TESTS=OFF -D TWOCONE_BUILD_BENCHMARKS=OFF \
  -D CMAKE_INSTALL_LIBDIR="lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)"
cmake --build "$build"
(cd "$build" && umask 022 && cpack)
mv "$build"/*.deb "$out"
(cd "$out" && sha256sum -- twocone-*.tar.gz {twocone,libtwocone,python3-twocone}*.deb | tee SHA256SUMS)
