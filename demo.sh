#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The main job in one command: sets everything up, drives the simulated robot through the lab, and writes the report.
#   ./demo.sh [--frames N] [--seed N] [--out DIR]
set -euo pipefail
cd "$(dirname "$0")"

frames=450
seed=1
out=""
while (($#)); do
  case "$1" in
    --frames | --seed | --out)
      if (($# < 2)); then echo "demo.sh: $1 needs a value" >&2; exit 2; fi
      declare "${1#--}=$2"; shift 2 ;;
    -h | --help) sed -n '3,4s/^# *//p' "$0"; exit 0 ;;
    *) echo "demo.sh: unknown option '$1' (./demo.sh --help)" >&2; exit 2 ;;
  esac
done
if ! [[ $frames =~ ^[1-9][0-9]*$ ]]; then echo "demo.sh: --frames is '$frames', must be a whole number from 1" >&2; exit 2; fi
if ! [[ $seed =~ ^[0-9]+$ ]]; then echo "demo.sh: --seed is '$seed', must be a whole number from 0" >&2; exit 2; fi

# A stereo frame takes about 0.55 s of processor time, shared by the cores. The first call also sets up and builds.
cores=$(nproc)
run_s=$((frames * 55 / 100 / (cores > 4 ? 4 : cores) + 5))
build="nothing to build"
[ -x build/release/twocone ] || build="the first call needs about 4 more minutes for set-up and building"
echo "demo: $frames stereo frames at 640x480, about $((run_s / 60)) min $((run_s % 60)) s on $cores cores; $build"

cmake/setup.sh
mkdir -p build
cmake --preset release >build/configure.log 2>&1 || { cat build/configure.log >&2; exit 1; }
cmake --build --preset release --target twocone

if [ -z "$out" ]; then
  out=runs/demo-seed$seed
  for ((i = 2; ; i++)); do [ -e "$out" ] || break; out=runs/demo-seed$seed-$i; done
fi
twocone=build/release/twocone
$twocone run --robot robots/lab_sim.yaml --frames "$frames" --seed "$seed" --out "$out" >/dev/null
$twocone report "$out"
