#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests builds without the kernel's camera headers, without libcamera, without libserialport, and without all three. Each must build,
# drive a simulated robot, pass its tests, and report in one line which library it lacks when a robot file requires it.
#   tests/evidence/without.sh [FOLDER]      folder of the four build folders; default: build
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

# For each device: its robot file in robots/, its driver, the Debian package that it needs, and its library.
declare -A robot=([V4L2]=usb_camera [LIBCAMERA]=pi_csi [SERIALPORT]=create2)
declare -A driver=([V4L2]=v4l2_camera [LIBCAMERA]=libcamera_camera [SERIALPORT]=serial_diffdrive)
declare -A package=([V4L2]=linux-libc-dev [LIBCAMERA]=libcamera-dev [SERIALPORT]=libserialport-dev)
declare -A library=([V4L2]=no_library_of_its_own [LIBCAMERA]=libcamera.so [SERIALPORT]=libserialport.so)
tests=(hal/hal_test drivers/drivers_test config/config_test)
# The parts of drivers_test that need neither POV-Ray nor much time.
filter='-SimPovray/*:SerialSchedules.*'

try() { # try NAME DEVICE...
  local name=$1 build=$folder/without-$1
  shift
  local off=() lacks=() device lacking test message status good
  for device in "$@"; do off+=(-D "TWOCONE_WITH_$device=OFF"); done
  if ! cmake --preset dev -B "$build" "${off[@]}" >"$work/configure" 2>&1; then
    tail -n 20 "$work/configure" >&2
    row "without $name: configures" "no" "yes" no
    return
  fi
  # The disabled features are listed below this heading, one per line.
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
    message=$("$build/twocone" run --robot "robots/${robot[$device]}.yaml" --frames 1 --out "$work/run_real" 2>&1) || status=$?
    good=no
    # If a robot lacks several libraries, the first one is reported.
    for lacking in "$@"; do
      if [[ $message == *"'${driver[$lacking]}' is not in this build"*"(Debian: ${package[$lacking]})"* ]]; then good=yes; fi
    done
    if [ "$status" -ne 1 ] || [ "$(wc -l <<<"$message")" -ne 1 ]; then good=no; fi
    row "without $name: ${robot[$device]}.yaml is refused in one line" "$message" "the driver, what it lacks, the package" "$good"
    ldd "$build/twocone" | grep -q "${library[$device]}" && good=no || good=yes
    row "without $name: linked with ${library[$device]//_/ }" "$([ $good = yes ] && echo no || echo yes)" "no" "$good"
  done
  rm -rf "$work/run_sim"
  "$build/twocone" run --robot robots/usb_camera_sim.yaml --frames 1 --out "$work/run_sim" >/dev/null 2>"$work/errors" && good=yes || good=no
  row "without $name: a simulated robot runs" "$good$(head -n 1 "$work/errors")" "yes" "$good"
  local passed=()
  for test in "${tests[@]}"; do
    # A failed program runs a second time: some tests depend on real time, and the machine may be busy.
    if "$build/tests/$test" --gtest_brief=1 "--gtest_filter=$filter" >"$work/test" 2>&1 ||
      "$build/tests/$test" --gtest_brief=1 "--gtest_filter=$filter" >"$work/test" 2>&1; then
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
