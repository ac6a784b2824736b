# SPDX-License-Identifier: Apache-2.0
# Pictures: rivals, tops, bearings, rims, and what tables and reports say of them.
found A.3 "a second pillar of a landmark's colour at 0.8 to 1.7 m, the landmark farther off" \
  "the nearer one is taken, \`ok\` or \`one_view\`, 1 to 2 m wrong" "\`two_candidates\` from half of the least that a landmark shows within the map's bounds; stray pixels and halves of one landmark are no rivals" \
  "vision/full_ranging_test:FullRanging.ANearerThing*" "vision/full_ranging_test:FullRanging.ARivalIs*" \
  "vision/full_ranging_test:FullRanging.ALandmarkInHalves*" "files/files_test:ToTargets.*"
found A.4 "tops 10 cm higher to 15 cm lower than the map says" "\`one_view\` from 7 to 10 cm on, +647 mm" "\`inconsistent\`, no range" \
  "vision/full_ranging_test:FullRanging.ATopThat*" "vision/full_ranging_test:FullRanging.TooNear*"
found A.7 "a free top, equal or impossible disparity, bearings that differ" "\`beyond_limit\` with the mean bearing; a bearing beside \`inconsistent\`" \
  "\`inconsistent\` with its chi-squared, no bearing" "vision/triangulation_test:Triangulate.BearingsThat*"
found A.12 "a picture size of -4 (the other halves of the line: localisation)" "accepted" "refused, naming the size" \
  "vision/full_ranging_test:FullRanging.Refuses*" "vision/paper_ranging_test:PaperRanging.*"
found A.15 "a wild answer in the table" "a number of 40 columns" "powers of ten in nine columns" "apps/report_table_test:Table.KeepsItsColumns*"
found C.4 "exchanged, mirrored and turned cameras in the guide's table" "the wrong verdicts" "those that are seen (documents; \`doctor\`'s part waits for the first day)" \
  "vision/full_ranging_test:FullRanging.ExchangedAndTurned*"
found D.3 "wrappers of swirlbox and others; the shipped fisheye robot" "the mask's edge is a rim with radius 124.5 px; \`doctor\` fails" \
  "the mask's edge is jagged and lies on no circle; a rim that does not stand out is said to be so, and a circle before black is found" \
  "vision/rim_test:FindRim.*" "sim_povray/sim_povray_render_test:MirrorFinderTest.TheMasksEdge*" "doctor/doctor_test:*Pictures.*:DoctorPicture.*"
found D.22 "the report's legend (the line's other parts: the house)" "verdicts of \`full\` in the paper's terms; \`occluded\` 15 of 15 beside 5 ranges" \
  "each method's own terms; how many of \`occluded\` have a range" "apps/report_write_test:WriteReport.ExplainsVerdicts*"
