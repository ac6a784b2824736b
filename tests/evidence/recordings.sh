#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Recordings: a run of 450 frames as MCAP, read by @mcap/core and imported again; a bag of Debian's rosbag; damaged files; live topics
# by Foxglove's own client; simulated cameras as devices, in the virtual machine of tests/vm.
also=(tests/evidence/recordings tests/fuzz tests/vm)
. "$(dirname "$0")/common.sh"
node=$work/node

drive() { $twocone run --robot robots/lab_sim.yaml --frames 450 --seed 1 --force --out "$work/run" --mcap "$work/run.mcap"; }
step drive drive
size=$(stat -c %s "$work/run.mcap" 2>/dev/null || echo 0)
images=$(cat "$work"/run/*er/*.png 2>/dev/null | wc -c || true)

install() (mkdir -p "$node" && cp tests/evidence/recordings/* "$node" && cd "$node" && npm install --no-audit --no-fund)
step npm install
step mcap node "$node/check_mcap.mjs" "$work/run.mcap" "$work/run"
value() { awk -v name="$2" '$1 == name { print $2 }' "$work/$1.log"; }
row "a run of 450 frames as MCAP: size, and that of its PNG files" "$((size / 1048576)) MiB, $((images / 1048576)) MiB" "at most 5 % more" "$(holds "$size <= 1.05 * $images")"
row "@mcap/core reads through the index: chunks, messages, as many as the file counts" "$(value mcap chunks), $(value mcap messages_read)" "$(value mcap messages_counted)" \
  "$([ "$(value mcap messages_read)" = "$(value mcap messages_counted)" ] && [ "$(value mcap chunks)" -gt 1 ] && echo yes || echo no)"
row "images in it that equal the run's files byte by byte" "$(value mcap images_equal)" "900" "$(holds "$(value mcap images_equal) == 900")"
row "message types in it, and those whose fields differ from the published ones" "$(value mcap types_compared), $(value mcap types_that_differ)" "0 differ" \
  "$(holds "$(value mcap types_compared) >= 20 && $(value mcap types_that_differ) == 0")"

# import NAME FILE: imports, localises and compares with the run
import() {
  rm -rf "$work/$1_imported" "$work/$1_compared"
  $twocone import --robot robots/lab_sim.yaml --recording "$2" --out "$work/$1_imported" &&
    $twocone localise "$work/$1_imported" >/dev/null &&
    $twocone compare "$work/run" "$work/$1_imported" --out "$work/$1_compared" --no-page --every 10
}
same_images() { # NAME
  local count=0 view file
  for view in lower upper; do
    for file in "$work/run/$view"/*.png; do cmp -s "$file" "$work/$1_imported/$view/$(basename "$file")" && count=$((count + 1)); done
  done
  echo "$count"
}
differing() { jq -r '[.sources[] | select(.verdict == "differs") | .name] | if length == 0 then "none" else join(", ") end' "$work/$1_compared/compare.json" 2>/dev/null || echo "not compared"; }
step again import again "$work/run.mcap"
row "imported again: images that are the same bytes" "$(same_images again)" "900" "$(holds "$(same_images again) == 900")"
row "imported again: what compare says differs" "$(differing again)" "none" "$([ "$(differing again)" = none ] && echo yes || echo no)"

bag() { PYTHONPATH=build/release/python:/usr/lib/python3/dist-packages /usr/bin/python3 tests/evidence/recordings/make_bag.py "$work/run" "$work/run.bag"; }
step bag bag
step from_bag import from_bag "$work/run.bag"
row "a bag of ROS 1, made by Debian's rosbag and imported: images that are the same bytes" "$(same_images from_bag)" "900" "$(holds "$(same_images from_bag) == 900")"
row "the same: what compare says differs" "$(differing from_bag)" "none" "$([ "$(differing from_bag)" = none ] && echo yes || echo no)"

fuzz() {
  cmake --preset asan -D TWOCONE_BUILD_FUZZERS=ON >/dev/null && cmake --build build/asan --target mcap_fuzz twocone_rosbag >/dev/null &&
    build/asan/tests/fuzz/mcap_fuzz 1000000 1
}
step fuzz fuzz
row "a million damaged MCAP files, with the address sanitizer" "$(tail -n 1 "$work/fuzz.log")" "no crash" "$(passed fuzz)"
small_bag() {
  $twocone run --robot tests/end_to_end/data/small.yaml --frames 3 --renderer native --force --out "$work/small" >/dev/null &&
    PYTHONPATH=build/release/python:/usr/lib/python3/dist-packages /usr/bin/python3 tests/evidence/recordings/make_bag.py "$work/small" "$work/small.bag" &&
    ASAN_OPTIONS=symbolize=0:max_allocation_size_mb=512:allocator_may_return_null=1 build/asan/tests/fuzz/mcap_fuzz 200000 1 "$work/small.bag"
}
step fuzz_bags small_bag
row "200,000 damaged bags of ROS 1, with the address sanitizer; the library that reads them is in a process of its own" "$(tail -n 1 "$work/fuzz_bags.log")" "no crash of twocone" "$(passed fuzz_bags)"

live() {
  $twocone run --robot robots/lab_sim.yaml --frames 150 --live --force --out "$work/live" >"$work/live.out" 2>&1 &
  local run=$! address=""
  for _ in $(seq 100); do
    address=$(sed -n 's/^.*Foxglove *\(ws:[^ ]*\).*$/\1/p' "$work/live.out" | head -n 1)
    [ -z "$address" ] || break
    sleep 0.1
  done
  (cd "$node" && timeout 120 node foxglove_client.mjs "$address")
  wait "$run"
}
step live live
row "Foxglove's own client on a live run of 150 frames: tracks, images, messages that were not decoded" \
  "$(value live /track), $(value live /lower/image), $(value live not_decoded)" "at least 140, 140, 0" \
  "$(holds "$(value live /track) >= 140 && $(value live /lower/image) >= 140 && $(value live not_decoded) == 0")"

step loopback tests/vm/loopback.sh
rows loopback
block "The topics of the file" "$(sed -n 's/^topics //p' "$work/mcap.log" | tr ',' '\n' | sed 's/^ //')"
page "recordings, and live topics"
