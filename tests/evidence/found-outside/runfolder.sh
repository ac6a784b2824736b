# SPDX-License-Identifier: Apache-2.0
# ../found-outside.sh sources this file: run folders without loss of data.
found C.12 'run with a control that the camera refuses, or with a camera that is busy' 'an empty run folder, which prevented the same command' \
  'a run that ends before its first frame leaves no folder; the folder of a killed start prevents nothing' \
  runs/runs_test:'DeviceRun.ThatFailsBeforeItsFirstFrame*' runlog/runlog_test:'NewFolder.*'
found D.1 '`localise DIR` during the run' 'both ended with status 0; ranges, fixes, timing and estimate held 14 of 40 frames' \
  'refused, with the folder and the process that writes it; results are exchanged as one folder, and a kill at any time leaves the old or the new ones' \
  runlog/runlog_test:'RunLock.*:*ResultsInTwoStates.*:ResultsExchange.*'
found D.2 'one image missing (`rm upper/000005.png`); all of `upper/`; frames.csv' '"5 of 40 frames", or tables emptied, status 0' \
  'the image is named and nothing is changed; --allow-missing leaves that frame without an answer (no_image)' \
  end_to_end/end_to_end_test:'RunInTheLab.LocaliseNamesAMissing*:RunInTheLab.AStoppedLocalise*'
found D.8a 'Ctrl-C during a run' 'status 1, neither folder nor next step, and no way to resume' \
  'status 130, folder and next step; run --resume DIR, equal to an uninterrupted run; refused with the difference where something changed' \
  end_to_end/end_to_end_test:'Resumed.*' runlog/runlog_test:'Disk.KeptLines*' script:tests/end_to_end/kill_trial.sh
found D.12 '`repeat:` with a name that is not ASCII; of an imported run' 'letters became ?; localise was named, which does not reproduce the run' \
  'letters stay, control characters are quoted; the import with its options, then localise' \
  report/report_test:'RepeatCommand.*' import/import_test:'*'
found D.13 'a robot named `../../x`' 'wrote outside runs/' 'refused: the name must be fit for a folder' config/config_test:'RobotFile.OnDiskHasAName*'
found D.14 'a run and a comparison that fail' 'empty folders that prevent the next call' 'no folder is left' \
  end_to_end/end_to_end_test:'RunInTheLab.ARunThatEndsBeforeItsFirstFrame*' runlog/runlog_test:'NewFolder.*' script:tests/end_to_end/wrong_input.sh
found D.15 'two calibrations in one folder' 'both write calibration.json: the second is refused' 'STEM.calibration.json and STEM.calibration_VIEW.svg' \
  script:tests/end_to_end/wrong_input.sh
found D.force '`--force`' 'there was no such option: users removed folders by hand' \
  'replaces only a run: no link, not the working folder, no folder with other files in it, no run that is being written' \
  runlog/runlog_test:'Replacing.*'

step kill_trial env TWOCONE_KILLS=200 TWOCONE_KILL_WHAT='run localise calibrate compare tradeoff' TWOCONE_KILL_FOLDER="$work/kill_trial_folder" \
  tests/end_to_end/kill_trial.sh "$twocone" "$PWD"
killed=$(sed -n 's/^KILL: \([0-9]*\) in all.*/\1/p' "$work/kill_trial.log")
interrupted=$(sed -n 's/^INT: \([0-9]*\) in all.*/\1/p' "$work/kill_trial.log")
resumed=$(sed -n 's/^\([0-9]*\) runs finished.*/\1/p' "$work/kill_trial.log")
row 'kills (-9) and interrupts of run, localise, calibrate, compare and tradeoff at random times, without a shorter table or a mixture' \
  "${killed:-none} and ${interrupted:-none}, $(grep -c '^FAILED' "$work/kill_trial.log" || true) failures" '200 and 200, 0 failures' \
  "$([ "${killed:-0}" -ge 200 ] && [ "${interrupted:-0}" -ge 200 ] && passed kill_trial || echo no)"
row 'resumed runs, byte-equal to the undisturbed one' "${resumed:-0} runs" 'all, at least 10' "$([ "${resumed:-0}" -ge 10 ] && passed kill_trial || echo no)"
block 'Kills and interrupts' "$(tail -n 5 "$work/kill_trial.log")"
