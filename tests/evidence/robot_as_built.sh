#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The first day of a rendered robot: it is built with errors, drives with what its first images show, is calibrated from that drive, and
# drives twice more. Frames and programs' output go into FOLDER. A call that failed says why in its last line.
#   robot_as_built.sh TWOCONE ROBOT SEED FOLDER
set -euo pipefail
twocone=$1 robot=$2 seed=$3 folder=$4
rm -rf "$folder"
mkdir -p "$folder"
"$twocone" as-built --robot "$robot" --seed "$seed" --unmodelled half --out "$folder" >"$folder/as-built.txt" 2>&1
if ! "$twocone" run --robot "$folder/believed.yaml" --self-rig --frames 120 --seed 1 --out "$folder/drive" >"$folder/drive.txt" 2>&1; then
  tail -n 1 "$folder/drive.txt"
  # One pair of images is not enough for it: it drives by its wheels, as its builder measured it.
  "$twocone" run --robot "$folder/believed.yaml" --frames 120 --seed 1 --out "$folder/drive" >"$folder/drive.txt" 2>&1
fi
begin=$SECONDS
"$twocone" calibrate "$folder/drive" --distortion --out "$folder/calibrated.yaml" >"$folder/calibrate.txt" 2>&1 || { tail -n 1 "$folder/calibrate.txt"; exit 1; }
echo "calibrated in $((SECONDS - begin)) s"
for drive in 1 2; do
  "$twocone" run --robot "$folder/calibrated.yaml" --frames 60 --seed "1$drive" --out "$folder/fresh$drive" >"$folder/fresh$drive.txt" 2>&1
done
