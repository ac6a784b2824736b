#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the packages of Debian 12 or 13 that twocone needs and that are missing. demo.sh, test.sh and evidence.sh run it.
#   cmake/setup.sh [--lint | --evidence]      also clang-format and clang-tidy, or the packages for evidence.sh
set -euo pipefail

packages=(
  g++ cmake ninja-build git ca-certificates dpkg-dev file
  libopencv-dev libeigen3-dev libyaml-cpp-dev libcli11-dev libfmt-dev libspdlog-dev nlohmann-json3-dev libboost-dev libode-dev libceres-dev libhwy-dev
  libgtest-dev libgmock-dev libbenchmark-dev librapidcheck-dev
  libserialport-dev libcamera-dev libturbojpeg0-dev libpng-dev libzstd-dev zlib1g-dev pkg-config
  protobuf-compiler libprotobuf-dev
  pybind11-dev python3-dev python3-numpy librosbag-storage-dev
  node-d3
  povray povray-includes procps
)
case "${1:-}" in
  --lint) packages+=(clang-format clang-tidy) ;;
  --evidence)
    packages+=(jq imagemagick cloc gnuplot-nox debootstrap povray-examples lintian time)
    # For the virtual machine of tests/vm, the tests in it, and the build of its modules.
    packages+=(qemu-system-x86 busybox-static cpio kmod udev v4l-utils valgrind libcamera-ipa linux-headers-amd64)
    packages+=(libmrpt-slam-dev) # tests/evidence/mrpt_slam.cpp
    packages+=(chromium chromium-driver firefox-esr nodejs) # tests/evidence/viewer.sh
    packages+=(mypy python3-rosbag python3-rospy python3-sensor-msgs python3-nav-msgs buildah mkdocs man-db) # python.sh, recordings.sh, release.sh
    command -v npm >/dev/null || packages+=(npm) # recordings.sh
    packages+=(slurm-wlm munge) # a cluster of one node, tests/evidence/slurm_node.sh
    ;;
esac

missing=()
for p in "${packages[@]}"; do
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$p" 2>/dev/null || true)" = installed ] || missing+=("$p")
done
if ((${#missing[@]})); then
  echo "setup: installing ${missing[*]}" >&2
  sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "setup: not root and no sudo: install these first: ${missing[*]}" >&2; exit 1; }
    sudo=(sudo)
  fi
  export DEBIAN_FRONTEND=noninteractive
  # The timeouts and retries prevent that a mirror which does not answer blocks the set-up.
  options=(-qq -o Acquire::Retries=3 -o Acquire::http::Timeout=60 -o DPkg::Lock::Timeout=300)
  "${sudo[@]}" apt-get "${options[@]}" update
  "${sudo[@]}" apt-get "${options[@]}" install -y --no-install-recommends "${missing[@]}" >/dev/null
fi
