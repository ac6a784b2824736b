# SPDX-License-Identifier: Apache-2.0
# renderer.sh sources this file: `twocone new` on the lab without its map and on scenes of povray-examples, and a drive in each.
# A row is met if every frame of the drive has a fix, or if `new` says in one line why there is no place for a robot.
examples=/usr/share/doc/povray/examples
drive_frames=15

# made NAME SCENE: makes a robot in the scene, drives, and writes the row
made() {
  local name=new_${1//[^a-z0-9_]/_} scene=$2 found frames fixes
  step "$name" "$twocone" new "$scene" --out "$work/$name" --force
  if [ "$(passed "$name")" = no ]; then
    found=$(tail -n 1 "$work/$name.log")
    row "new: $1" "no robot: ${found##*"$scene": }" "fixes in all frames, or the reason in one line" \
      "$([ "$(status_of "$name")" = 1 ] && [ "$(wc -l <"$work/$name.log")" = 1 ] && echo yes || echo no)"
    return
  fi
  step "${name}_drive" "$twocone" run --robot "$(ls "$work/$name/"*.yaml | grep -v '\.map\.yaml$')" --frames "$drive_frames" --out "$work/$name/run" --force
  frames=$(grep -c '' "$work/$name/run/frames.csv" 2>/dev/null || echo 1)
  fixes=$(cut -d, -f3 "$work/$name/run/fixes.csv" 2>/dev/null | grep -cx ok || true)
  found="$(grep -c 'added, in the wrapper$' "$work/$name.log" || true) landmarks added, $(sed -n '/^landmarks /,/^$/p' "$work/$name.log" | grep -c ':[0-9]*$' || true) of the scene; "
  found+="$(sed -n 's/^open area *\([0-9.]* m2\).*/\1/p' "$work/$name.log") open, $(sed -n 's/^obstacles *//p' "$work/$name.log") obstacles"
  row "new: $1" "$found; fixes in $fixes of $((frames - 1)) frames" "fixes in all frames, or the reason in one line" \
    "$(holds "${fixes:-0} == $drive_frames")"
}

mkdir -p "$work/lab_alone"
cp scenes/lab.pov "$work/lab_alone/"
made lab "$work/lab_alone/lab.pov"
off=$(awk '
  # Lines of the map, then of what was found: the greatest difference of a landmark, in mm.
  NR == FNR { if (match($0, /name: [a-z]+/)) { n = substr($0, RSTART + 6, RLENGTH - 6); split($0, p, /[xy]_m: /); x[n] = p[2] + 0; y[n] = p[3] + 0 }; next }
  $1 in x && NF == 6 { d = 1000 * sqrt(($2 - x[$1]) ^ 2 + ($3 - y[$1]) ^ 2); if (d > most) most = d; ++count }
  END { print (count == 6 ? most + 0 : 1e9) }' scenes/lab.map.yaml "$work/new_lab.log" 2>/dev/null || echo 1e9)
row "new: the lab's six landmarks, against its map" "greatest difference $off mm" "within 1 mm" "$(holds "$off <= 1")"
for scene in advanced/{wineglass,woodbox,pawns,lamppost,desk/desk,drums2/drums,optics,benchmark/benchmark} objects/{prism1,torus1,lathe1a,ttf1,primitiv} \
  lights/{spotlite,shadows} interior/{ballbox1,fog_std,skysph1,magglass} incdemo/shapes language/macros/macro1 camera/perspective radiosity/cornell; do
  made "$scene" "$examples/$scene.pov"
done
