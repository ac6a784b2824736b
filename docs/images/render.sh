#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Renders the images of the lab in README and docs again.
set -euo pipefail
cd "$(dirname "$0")/../.."
render() { # render VIEW WIDTH HEIGHT
  povray +I"scenes/views/$1.pov" +Lscenes +W"$2" +H"$3" +A0.1 +AM2 +R3 +FJ88 -D -GA +O"docs/images/$1.jpg" 2>/dev/null
}
render outside 1200 800
render robot 720 720
render overhead 860 720
# The page about scenes shows what `twocone look` draws.
looked=$(mktemp -d)
build/release/twocone look --robot robots/lab_sim.yaml --out "$looked"
cp "$looked/above.svg" docs/images/look.svg
rm -r "$looked"
