# SPDX-License-Identifier: Apache-2.0
# found-outside.sh sources this file. Images: rivals, tops, bearings, rims, and their tables and reports.
found A.3 "a second object with a landmark's colour at 0.8 to 1.7 m, the landmark farther away" \
  "the nearer one is taken, \`ok\` or \`one_view\`, 1 to 2 m wrong" "\`two_candidates\` from half of the smallest image that a landmark has within the map's bounds; stray pixels and halves of one landmark are no rivals" \
  "vision/vision_test:OutlineRanging.ANearerThing*" "vision/vision_test:OutlineRanging.ARivalIs*" \
  "vision/vision_test:OutlineRanging.ALandmarkInHalves*" "config/config_test:ToTargets.*"
found A.4 "tops 10 cm higher to 15 cm lower than in the map" "\`one_view\` from 7 to 10 cm on, +647 mm" "\`inconsistent\`, no range" \
  "vision/vision_test:OutlineRanging.ATopThat*" "vision/vision_test:OutlineRanging.TooNear*"
found A.7 "a free top, equal or impossible disparity, bearings that differ" "\`beyond_limit\` with the mean bearing; a bearing beside \`inconsistent\`" \
  "\`inconsistent\` with its chi-squared, no bearing" "vision/vision_test:Triangulate.BearingsThat*"
found A.12 "an image size of -4 (the other halves of the line: localisation)" "accepted" "refused, naming the size" \
  "vision/vision_test:OutlineRanging.Refuses*" "vision/vision_test:PaperRanging.*"
found A.15 "a wild answer in the table" "a number of 40 columns" "powers of ten in nine columns" "report/report_test:Table.KeepsItsColumns*"
found C.4 "exchanged, mirrored and turned cameras in the guide's table" "the wrong verdicts" "the verdicts that occur (documents; the part of \`doctor\` needs real devices)" \
  "vision/vision_test:OutlineRanging.ExchangedAndTurned*"
found D.3 "wrappers of swirlbox and others; the shipped fisheye robot" "the mask's edge is a rim with radius 124.5 px; \`doctor\` fails" \
  "the mask's edge is jagged and lies on no circle; a rim that is not distinct is reported as such, and a circle in front of black is found" \
  "vision/vision_test:FindRim.*" "sim_povray/sim_povray_test:MirrorFinderTest.TheMasksEdge*" "doctor/doctor_test:*Images.*:DoctorImage.*"
found D.22 "the report's legend" "verdicts of \`outline\` in the paper's terms; \`occluded\` 15 of 15 beside 5 ranges" \
  "each method's own terms; the number of \`occluded\` ones with a range" "report/report_test:WriteReport.ExplainsVerdicts*"
