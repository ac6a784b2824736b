# SPDX-License-Identifier: Apache-2.0
# Sourced by ../found-outside.sh: run folders that lose nothing.
found C.12 'run with a control that the camera refuses, or with a camera that is busy' 'an empty run folder, which barred the same command' \
  'a run that ends before its first frame leaves no folder; what a killed start leaves bars nothing' \
  runs/device_run_test:'DeviceRun.ThatFailsBeforeItsFirstFrame*' runs/runs_disk_test:'NewFolder.*'
found D.1 '`localise DIR` while the run still goes on' 'both ended with status 0; ranges, fixes, effort and estimate held 14 of 40 frames' \
  'refused, with the folder and the process that writes it; results are exchanged as one folder, and a kill at any step leaves the old or the new ones' \
  runs/runs_disk_test:'RunLock.*:*ResultsInTwoStates.*:ResultsExchange.*'
found D.2 'one image missing (`rm upper/000005.png`); all of `upper/`; frames.csv' '"5 of 40 frames", or tables emptied, status 0' \
  'the image is named and nothing changed; --allow-missing leaves that frame without an answer (no_image)' \
  end_to_end/run_test:'RunInTheLab.LocaliseNamesAMissing*:RunInTheLab.LocaliseThatIsStopped*'
found D.8a 'Ctrl-C during a run' 'status 1, neither folder nor next step, and no way to go on' \
  'status 130, folder and next step; run --resume DIR, equal to an unbroken run; refused with the difference where something changed' \
  end_to_end/run_test:'Resumed.*' runs/runs_disk_test:'Disk.KeptLines*' script:tests/end_to_end/kill_trial.sh
found D.12 '`repeat:` with a name that is not ASCII; of an imported run' 'letters became ?; localise was named, which does not make the run' \
  'letters stay, control characters are quoted; the import with its options, then localise' \
  apps/report_table_test:'RepeatCommand.*' foreign/foreign_test:'*'
found D.13 'a robot named `../../x`' 'wrote outside runs/' 'refused: the name must be fit for a folder' files/files_test:'RobotFile.OnDiskHasAName*'
found D.14 'a run and a comparison that fail' 'empty folders that bar the next try' 'no folder is left' \
  end_to_end/run_test:'RunInTheLab.ThatEndsBeforeItsFirstFrame*' runs/runs_disk_test:'NewFolder.*' script:tests/end_to_end/wrong_input.sh
found D.15 'two calibrations in one folder' 'both write calibration.json: the second is refused' 'STEM.calibration.json and STEM.calibration_VIEW.svg' \
  script:tests/end_to_end/wrong_input.sh
found D.force '`--force`' 'there was none: people removed folders by hand' \
  'replaces a run and nothing else: no link, not the working folder, no folder with other files in it, no run that is being written' \
  runs/runs_disk_test:'Replacing.*'

step kill_trial env TWOCONE_KILLS=200 TWOCONE_KILL_WHAT='run localise calibrate compare tradeoff' TWOCONE_KILL_FOLDER="$work/kill_trial_folder" \
  tests/end_to_end/kill_trial.sh "$twocone" "$PWD"
killed=$(sed -n 's/^KILL: \([0-9]*\) in all.*/\1/p' "$work/kill_trial.log")
interrupted=$(sed -n 's/^INT: \([0-9]*\) in all.*/\1/p' "$work/kill_trial.log")
resumed=$(sed -n 's/^\([0-9]*\) runs finished.*/\1/p' "$work/kill_trial.log")
row 'kills (-9) and interrupts of run, localise, calibrate, compare and tradeoff at random moments, without a shorter table or a mixture' \
  "${killed:-none} and ${interrupted:-none}, $(grep -c '^FAILED' "$work/kill_trial.log" || true) failures" '200 and 200, 0 failures' \
  "$([ "${killed:-0}" -ge 200 ] && [ "${interrupted:-0}" -ge 200 ] && passed kill_trial || echo no)"
row 'resumed runs, byte-equal to the unbroken one' "${resumed:-0} runs" 'all, at least 10' "$([ "${resumed:-0}" -ge 10 ] && passed kill_trial || echo no)"
block 'Kills and interrupts' "$(tail -n 5 "$work/kill_trial.log")"
