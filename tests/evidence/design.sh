#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Designed rigs: what is predicted of a landmark's range, against runs of their simulated twins; requirements that cannot be met.
. "$(dirname "$0")/common.sh"

# rig NAME OPTION...: designs a rig, and drives its twin with a noisy camera. The edges' noise is that of the run, the rest is predicted.
rig() {
  local name=$1
  shift
  step "design_$name" "$twocone" design --out "$work/$name" --force "$@"
  step "run_$name" "$twocone" run --robot "$work/$name/design.yaml" --frames 120 --out "$work/run_$name" \
    --set effects.camera.full_well_electrons=3000 --set effects.camera.read_noise_electrons=12 \
    --set cameras.lower.antialias=3 --set cameras.upper.antialias=3
  local ratio
  # Of the six landmarks, the root mean square of error over prediction.
  ratio=$(log "run_$name" | awk '/^Beside the Cram/ { on = 1 } on && /^(red|green|blue|cyan|magenta|yellow) / { n++; s += $5 * $5 } /^position / { on = 0 } END { if (n == 6) printf "%.2f", sqrt(s / n) }')
  row "rig $name (${*:-defaults}): error of ranges to landmarks over the predicted sigma" "${ratio:-none}" "0.8 to 1.2" "$(holds "${ratio:-0} >= 0.8 && ${ratio:-0} <= 1.2")"
  local position
  position=$(log "run_$name" | awk '/^position / && NF > 4 { print $5; exit }')
  row "rig $name: error of the position over the predicted sigma" "${position:-none}" "0.8 to 1.2" "$(holds "${position:-0} >= 0.8 && ${position:-0} <= 1.2")"
  block "design of rig $name" "$(log "design_$name")"
}
rig usual
rig level --lowest-deg 2 --highest-deg 14
rig wide --camera-deg 61.6 --lowest-deg -20 --highest-deg 6 --lens-height-m 0.14 --greatest-radius-m 0.08
rig accurate --lowest-deg -9 --highest-deg 8 --sigma-m 0.008
rig small --greatest-radius-m 0.04 --lens-height-m 0.15 --camera-deg 55

# refused NAME NEAREST OPTION...: what cannot be, and all options of the nearest that can
refused() {
  local name=$1 nearest=$2
  shift 2
  step "refused_$name" bash -c '! "$@" 2>&1' - "$twocone" design --out "$work/refused_$name" --force "$@"
  step "nearest_$name" "$twocone" design --out "$work/refused_$name" --force $nearest
  row "refused: $*; designed: $nearest" "$(log "refused_$name" | tail -n 1)" "refused with the nearest that can" \
    "$([ "$(passed "refused_$name")$(passed "nearest_$name")" = yesyes ] && log "refused_$name" | grep -q 'nearest:' && echo yes || echo no)"
}
refused floor "--floor-from-m 1.12" --floor-from-m 0.5
refused accuracy "--sigma-m 0.0044" --sigma-m 0.004
refused height "--greatest-height-m 0.405" --greatest-height-m 0.4
refused band "--lowest-deg -0.9 --highest-deg 20" --lowest-deg -30 --highest-deg 20
refused camera "--greatest-radius-m 0.172 --camera-deg 120 --lowest-deg -20 --highest-deg 5" --camera-deg 120 --lowest-deg -20 --highest-deg 5
# The profile for the lathe, in a CAD program: it prints the drawing, and the longest line of the page is the mirror. Its slope is
# that of the file.
printed() {
  (cd "$work/usual" && QT_QPA_PLATFORM=offscreen XDG_RUNTIME_DIR=/tmp timeout 60 librecad dxf2pdf -a -k design.dxf) && python3 - "$work/usual/design" <<'PYTHON'
import math, re, sys, zlib
page = open(sys.argv[1] + ".pdf", "rb").read()
text = "".join(zlib.decompress(part).decode("latin1") for part in re.findall(rb"stream\r?\n(.*?)endstream", page, re.S) if part[:1] == b"x")
lines = [list(map(float, line)) for line in re.findall(r"(\S+) (\S+) m\n(\S+) (\S+) l\nS", text)]
groups = open(sys.argv[1] + ".dxf").read().split("\n")
mirror = groups.index("MIRROR")
to = {groups[i].strip(): float(groups[i + 1]) for i in range(mirror + 1, mirror + 13, 2)}
x0, y0, x1, y1 = max(lines, key=lambda line: math.dist(line[:2], line[2:]))
print(f"{len(lines)} lines; {abs((y1 - y0) / (x1 - x0)):.4f} printed, {to['21'] / to['11']:.4f} in the file")
PYTHON
}
if command -v librecad >/dev/null; then
  step printed printed
  row "design.dxf printed by $(dpkg-query -W -f '${Package} ${Version}' librecad): slope of the mirror" "$(log printed | tail -n 1)" "equal to 1e-3" \
    "$(holds "$(log printed | sed -n 's/.*; \([0-9.]*\) printed, \([0-9.]*\) .*/(\1 - \2)^2 < 1e-6/p')")"
else
  row "design.dxf in a CAD program" "librecad is not installed" "printed" no
fi
page "designed rigs"
