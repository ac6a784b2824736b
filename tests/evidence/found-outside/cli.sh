# SPDX-License-Identifier: Apache-2.0
# ../found-outside.sh sources this file: the command line, tables and pages.
command_line=script:tests/end_to_end/command_line.sh
wrong_input=script:tests/end_to_end/wrong_input.sh

found A.16a 'localise --robot F, where F names another map than the run' 'the run'"'"'s map was used without a message' \
  'its map is used, and the events name it; a map of another room is refused, with both maps named, unless --map names it' \
  runs/runs_test:'OtherRobot.BringsItsMap*' "$command_line"
found A.16b 'distortion_focal_px in rig: and in effects:' 'a pair here, a single number there' \
  'either takes a number or a pair; two unequal numbers are refused in effects:, as a simulated lens has one focal length' \
  config/config_test:'RigKeys.ALensComes*:RobotFile.TakesTheFocalLength*:*DistortionOfTwoFocalLengths*'
found D.4 'compare --max-latency-ms 20 of two equal robots: 23.84 ms, whose sigma is 45 ms' 'status 1, no sigma on the terminal' \
  'the row cannot tell; status 3; the terminal shows 23.84 +- 45' compare/compare_test:'Light.ASigma*:Rows.ANumberWhoseSigma*:CompareTable.*:CompareJson.*' "$command_line"
found D.5 '--seed -1 and --seed 99999999999999999999999' '18446744073709551615 was used' 'refused, with the range (run and tradeoff)' \
  report/report_test:'CommandLine.ASeed*' "$wrong_input"
found D.16a 'gap table: odometry 25.3 to 13.9, floor 14.0' 'unexplained 100 %' \
  'unexplained is the part that remains after the correction; the part that no source names has its own share and line' \
  compare/compare_test:'Shares.WhatTheCalibrationPutsRight*:Shares.OfRanges*'
found D.16b 'compare --scene where wheels slip' 'floor of odometry 0' 'no floor: poses that are rendered again are not driven' \
  compare/compare_test:'Shares.PlacesThatAreRendered*'
found D.19a 'run > /dev/full, and with a closed standard output' 'table lost, status 0' 'status 1, cannot write to standard output; the run folder is whole' "$command_line"
found D.19b 'SIGHUP during a run' 'the run ended without a message' 'ends in good order as with SIGTERM, unless the signal was ignored at the start; listed in the table of what stops the wheels' "$command_line"
found D.20a 'compare of a lab run with a hall run' 'status 0, one note' 'refused, with both maps named; judged by the distances between landmarks of the same name' \
  compare/compare_test:'WhyOtherRooms.*' "$command_line"
found D.20b 'tradeoff: bearings of method paper' 'yes in tables, ranges under the pointer' 'no in terminal, page and CSV' \
  tradeoff/tradeoff_test:'Csv.BearingsOfMethodPaper*:Table.BearingsOfMethodPaper*'
found D.21a 'unknown options and words' 'words in reversed order, no suggestion, the wrong --help' 'in their order, did you mean --X?, see twocone COMMAND --help' \
  report/report_test:'CommandLine.*' "$wrong_input"
found D.21b 'twocone help' 'no such command' 'prints what --help prints' "$command_line"
found D.21c 'twocone compare --help' 'RUN(1x) in usage' 'RUN [RUN]' report/report_test:'CommandLine.UsageShows*'
found D.21d 'a tab in YAML' 'end of map not found' 'FILE:LINE: the line is indented by a tab, must be by spaces' \
  config/config_test:'ReadingFiles.SyntaxErrors*' "$wrong_input"
found D.21e 'progress bar in 40 columns' 'floods the terminal' 'shortens bar, time and name, in this order' report/report_test:'ProgressLine.*'
found D.22a 'README: only timing.csv depends on the machine' 'frames.csv, run.yaml and summary.json differ too' 'README names all differences; everything else is compared' "$command_line"
found D.22b 'README: metre-sized errors of the baseline' 'the table'"'"'s largest is 166 mm' 'README states which runs have them, and where; it shows each kind of line that is printed' "$command_line"
found D.22c 'lab_sim.yaml: twocone devices lists the drivers' 'it lists devices' 'names docs/drivers.md, which lists them' config/config_test:'ShippedFiles.EveryDriver*'
