#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The release: two builds of the packages, lintian, a fresh Debian on which they are installed, upgraded from 0.1 and purged, the three
# examples of the Python package there, the documentation as HTML, an image for containers, the promise of compatibility.
# TWOCONE_EVIDENCE_0_1=COMMIT: the commit of version 0.1 whose package is upgraded; unless given, the last one.
also=(python docs/man docs/site tests/formats tests/package)
. "$(dirname "$0")/common.sh"
version=$(sed -n 's/^project(twocone VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)

step first cmake/package.sh "$work/first"
# The second build is of a clone at another place.
second() {
  rm -rf "$work/clone" && git clone -q . "$work/clone" && git -C "$work/clone" checkout -q "$(cat "$work/first.commit")" &&
    "$work/clone/cmake/package.sh" "$work/second"
}
step second second
same=$(cmp -s "$work/first/SHA256SUMS" "$work/second/SHA256SUMS" && echo yes || echo no)
row "files of two builds at two places with the same SHA-256 (source, packages)" "$(comm -12 <(sort "$work/first/SHA256SUMS") <(sort "$work/second/SHA256SUMS") | wc -l) of $(wc -l <"$work/first/SHA256SUMS")" "all" "$same"
lint() { lintian --allow-root --fail-on none --tag-display-limit 0 "$work"/first/*.deb; }
step lintian lint
findings=$(grep -c '^[EW]:' "$work/lintian.log" || true)
row "lintian's errors and warnings, beyond those overridden with a reason" "$findings" "0" "$(holds "$findings == 0")"

before=${TWOCONE_EVIDENCE_0_1:-$(git log -n 1 --format=%H -S'project(twocone VERSION 0.1' -- CMakeLists.txt)^}
old() (
  rm -rf "$work/old" && git worktree prune && git worktree add -f --detach "$work/old" "$before" && cd "$work/old" &&
    cmake --preset release -D TWOCONE_BUILD_TESTS=OFF -D TWOCONE_BUILD_BENCHMARKS=OFF && cmake --build build/release &&
    cd build/release && cpack && cp ./*.deb "$work"
)
step old old
step debian tests/evidence/release/on_debian.sh "$work/first" "$version" "$work/twocone_0.1.0_$(dpkg --print-architecture).deb"
rows debian

step site docs/site/build.py "$work/site"
row "documentation as static HTML: pages, without a link that leads nowhere" "$(find "$work/site" -name '*.html' | wc -l)" "at least 60" \
  "$(holds "$(find "$work/site" -name '*.html' | wc -l) >= 60 && $(status_of site) == 0")"
container() { tests/evidence/release/container.sh "$work/first/twocone-$version.tar.gz"; }
step container container
row "the image for containers, by buildah: three frames in it" "$(tail -n 1 "$work/container.log")" "frames with fixes" "$(passed container)"

promises() { cmake --preset dev >/dev/null && cmake --build --preset dev >/dev/null && ctest --test-dir build/dev --no-tests=error --output-on-failure -R '^OldFormats|^FilesOf1_0|^package\.|^python\.interface'; }
step promises promises
row "tests of the promise of compatibility: files of 0.1 and 1.0, command line, C++ and Python" "$(grep 'tests passed' "$work/promises.log")" "all" "$(passed promises)"
block "SHA-256 of the first build" "$(cat "$work/first/SHA256SUMS")"
page "version $version"
