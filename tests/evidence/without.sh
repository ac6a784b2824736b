#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds without the kernel's camera headers, without libcamera, without libserialport, and without all three: each builds,
# drives a simulated robot, passes its tests, and says in one line what it lacks when a robot file asks for it.
#   tests/evidence/without.sh [FOLDER]      where the four build folders go; default: build
# Prints lines `row | WHAT | FIGURE | TARGET | yes|no`; exits 0 only if all are yes.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=${1:-build}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

unmet=0
row() { # row WHAT FIGURE TARGET yes|no
  [ "$4" = yes ] || unmet=$((unmet + 1))
  echo "row | $1 | $2 | $3 | $4"
}

# What a driver needs, its robot file among robots/, its package and its library.
declare -A robot=([V4L2]=usb_camera [LIBCAMERA]=pi_csi [SERIALPORT]=create2)
declare -A driver=([V4L2]=v4l2_camera [LIBCAMERA]=libcamera_camera [SERIALPORT]=serial_diffdrive)
declare -A package=([V4L2]=linux-libc-dev [LIBCAMERA]=libcamera-dev [SERIALPORT]=libserialport-dev)
declare -A library=([V4L2]=no_library_of_its_own [LIBCAMERA]=libcamera.so [SERIALPORT]=libserialport.so)
tests=(hal/hal_test drivers/backends_test drivers/memory_test drivers/memory_conformance_test drivers/serial_diffdrive_test files/files_test)

try() { # try NAME DEVICE...
  local name=$1 build=$folder/without-$1
  shift
  local off=() lacks=() device lacking test said status good
  for device in "$@"; do off+=(-D "TWOCONE_WITH_$device=OFF"); done
  if ! cmake --preset dev -B "$build" "${off[@]}" >"$work/configure" 2>&1; then
    tail -n 20 "$work/configure" >&2
    row "without $name: configures" "no" "yes" no
    return
  fi
  # What is disabled stands below that heading, a line each.
  for device in "$@"; do
    sed -n '/features have been disabled/,$p' "$work/configure" | grep -q "\* $device," || lacks+=("$device")
  done
  row "without $name: the summary of the configuration names what is off; not named" "${lacks[*]:-none}" "none" "$([ ${#lacks[@]} -eq 0 ] && echo yes || echo no)"
  local targets=(twocone)
  for test in "${tests[@]}"; do targets+=("${test#*/}"); done
  if ! cmake --build "$build" --target "${targets[@]}" >"$work/build" 2>&1; then
    grep -m 5 -E 'error|FAILED' "$work/build" >&2
    row "without $name: builds with warnings as errors" "no" "yes" no
    return
  fi
  row "without $name: builds with warnings as errors" "yes" "yes" yes

  for device in "$@"; do
    status=0
    said=$("$build/twocone" run --robot "robots/${robot[$device]}.yaml" --frames 1 --out "$work/run_real" 2>&1) || status=$?
    good=no
    # A robot that lacks several is told the first.
    for lacking in "$@"; do
      if [[ $said == *"'${driver[$lacking]}' is not in this build"*"(Debian: ${package[$lacking]})"* ]]; then good=yes; fi
    done
    if [ "$status" -ne 1 ] || [ "$(wc -l <<<"$said")" -ne 1 ]; then good=no; fi
    row "without $name: ${robot[$device]}.yaml is refused in one line" "$said" "the driver, what it lacks, the package" "$good"
    ldd "$build/twocone" | grep -q "${library[$device]}" && good=no || good=yes
    row "without $name: linked with ${library[$device]//_/ }" "$([ $good = yes ] && echo no || echo yes)" "no" "$good"
  done
  rm -rf "$work/run_sim"
  "$build/twocone" run --robot robots/usb_camera_sim.yaml --frames 1 --out "$work/run_sim" >/dev/null 2>"$work/said" && good=yes || good=no
  row "without $name: a simulated robot runs" "$good$(head -n 1 "$work/said")" "yes" "$good"
  local passed=()
  for test in "${tests[@]}"; do
    # Again where it failed: some hold real time, and a builder's machine is busy.
    if "$build/tests/$test" --gtest_brief=1 >"$work/test" 2>&1 || "$build/tests/$test" --gtest_brief=1 >"$work/test" 2>&1; then
      passed+=("${test#*/}")
    else
      grep -m 3 -A 8 Failure "$work/test" >&2 || true
    fi
  done
  row "without $name: test programs passed" "${passed[*]}" "all ${#tests[@]}" "$([ ${#passed[@]} -eq ${#tests[@]} ] && echo yes || echo no)"
}

try V4L2 V4L2
try libcamera LIBCAMERA
try libserialport SERIALPORT
try all V4L2 LIBCAMERA SERIALPORT
exit $((unmet != 0))
