# SPDX-License-Identifier: Apache-2.0
# found-outside.sh sources this file: simulated worlds and scenes of other authors.
simulator=sim_povray/sim_povray_test

found D.6 "\`start:\` a metre away from the robot's place in the scene; \`mirror_radius_m: 60\`" \
  "every fix \`ok\` and wrong by a metre, no warning; accepted" \
  "both places are named: a warning from 20 mm or 2 degrees, the end of the run beyond \`body.radius_m\`; 60 m is refused" \
  "runs/runs_test:StartCheck.*" "$simulator:ShownCamera.*" "config/config_test:*MirrorInMillimetres*"
found D.7 "README's block *Several robots*, pasted" "the robots fail: the world is not served yet" \
  "\`run\` waits up to 5 s for the world" "script:tests/end_to_end/served.sh"
found D.8 "Ctrl-C while the first images are rendered (an endless \`#while\`); the first seconds of a run" \
  "no reaction for 120 s; nothing is printed for 3 to 4 s" "ends within a second; the first line is printed at once" \
  "script:tests/end_to_end/scene_of_others.sh"
found D.9 "a scene with \`#fopen F \"/home/me/notes\" write\`" \
  "the file is overwritten, once by each POV-Ray process. Debian's povray.conf says \`restricted\`, but POV-Ray 3.7.0.10 does not enforce it" \
  "refused by the kernel (Landlock; without it seccomp), for reading and writing; \`effects\` describes the confinement" \
  "$simulator:*ConfinementTest.*" "$simulator:SealedFile.*" "$simulator:SceneAccess.*" "script:tests/end_to_end/scene_of_others.sh"
found D.10 "a scene that writes a file and reads it again" "fails in 2 of 9 runs: several processes race" \
  "refused every time: a scene may write no file" "$simulator:*ConfinementTest.ASceneWritesNoFile*"
found D.11 "a wrapper of a scene that has includes and images beside it" \
  "not found, and the message gives no advice" \
  "the included scene's own folder is searched, the map's \`scene_paths:\` name folders, and the message has the line to add" \
  "$simulator:*ConfinementTest.TheFolderOfAnIncludedScene*" "$simulator:*ConfinementTest.OtherFilesAreNotRead*:*ConfinementTest.AMissingFileIsReported*" "config/config_test:MapFile.HoldsEveryFieldOfTheFile"
found D.17 "a robot with another map attaches to a served world" "accepted: ranges wrong by 649 mm" \
  "refused, with the first difference" "$simulator:Outline.*" "$simulator:SimulationHostTest.ARobotWithAnotherMap*"
found D.18a "\`effects --verify\` of a scene with \`crand\`; of the wine glass" \
  "13,130 pixels differ without a reason, status 0; 39 pixels, unexplained; \"saved -9 %\"" \
  "the cause is named with file and line, and unintended differences are a failure; the depth of reflections is tested; times that overlap are not reported" \
  "$simulator:VerifyEffects.*"
found D.18b "reasons that point at declarations that nothing uses" "\`textures.inc:918\` in the wine glass" \
  "correct behaviour: that is the finish of Silver_Texture, which line 203 of the scene names; of 1,430 reasons in povray-examples none is in a declaration without a use" \
  "$simulator:SceneCalls.ADeclarationCountsOnlyIfActiveTextNamesIt:SceneCalls.PovRaysOwnIncludesRequireNothingByThemselves"
found D.19 "a robot of a served world is suspended (SIGSTOP)" "it holds up the others forever" \
  "it is removed after 30 s, and the others continue" "$simulator:Link.ARobotThatAsksForNothing*" "$simulator:Link.ARobotThatWaitsForItsImages*"
found D.21 "a misspelt name in a scene; \"start of robot touches wall\"; \`--scene x.pov\`" \
  "no list of names; no file and line; \"3:12: illegal map value\"" "the existing names; file and line; the expected kind of file" \
  "$simulator:Scene.ReportsWhatItSearchedFor" "$simulator:SimulationHostTest.ARobotJoinsOnce*" "config/config_test:MapFile.ASceneInPlaceOfAMap*"

step examples tests/evidence/found-outside/povray_examples.bash "$twocone" "$work/examples"
count() { awk -v name="$1" '$1 == name { print $2 }' "$work/examples.log"; }
if [ "$(passed examples)" = yes ]; then
  row "scenes of povray-examples, 80 x 60, 60 s each" \
    "of $(count scenes) scenes $(count alone) render by themselves, $(count wrapped) of them through a wrapper; $(count failed) do not" \
    "each, or the reason is named" "$(holds "$(count unnamed) == 0")"
  row "files that scenes wrote through a wrapper" "$(count wrote); $(sed -n 's/^examples //p' "$work/examples.log")" "none" \
    "$(holds "$(count wrote) == 0 && \"$(sed -n 's/^examples //p' "$work/examples.log")\" == \"unchanged\"")"
  block "Scenes that render by themselves and not through a wrapper" "$(sed -n 's/^fails through the wrapper: //p' "$work/examples.log")"
else
  row "scenes of povray-examples, 80 x 60, 60 s each" "$(status_of examples)" "each, or the reason is named" no
fi
