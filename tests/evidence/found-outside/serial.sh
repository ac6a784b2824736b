# SPDX-License-Identifier: Apache-2.0
# ../found-outside.sh sources this file: the serial line, its watchdog, and the messages of doctor and devices.
drivers=drivers/drivers_test

found C.1 'a reset of the board without the boot loader'"'"'s pause' 'every call fails for 3.9 to 4.1 s, the driver is one line behind' \
  'over within 0.3 s: stops by program and watchdog are counted, and a request with a unique answer restores the synchronisation' \
  "$drivers:SerialSchedules.AResetWithoutABootLoader*" "$drivers:RosArduinoBridge.StopsOfOthers*"
found C.2 'a period of 490 to 525 ms and a time-out of 500' 'up to 8 of 16 calls fail; a failed command was executed and stopped without a message' \
  'none fails; a command that the watchdog stopped while the program was delayed reports that, and the wheels stay stopped' \
  "$drivers:SerialSchedules.CommandsAboutAsFarApart*" "$drivers:WithWatchdog.AnswersToTheWatchdogsStops*" "$drivers:Roboclaw.StopsOfOthers*"
found C.5 '0.1 and 0.2 rad/s at 1,440 counts a turn' 'no wheel moves, and no message' \
  'refused, with the least speed that turns a wheel; doctor measures it (least_speed_radps)' \
  "$drivers:SerialDriveSpeeds.*" doctor/doctor_test:'Moving/Drives.AreJudged/turns_*' config/config_test:'DeviceKeys.*'
found C.6 'kRefused of many causes' 'doctor: end the program that has the port' 'each refusal states after a semicolon what to do about its cause; doctor prints that' \
  doctor/doctor_test:'DoctorAdvice.*'
found C.7 'a GPS, a wrong baud rate, another protocol' 'no answer' 'the received bytes are quoted' "$drivers:SerialDriveOpening.*"
found C.8 'the same camera in both entries' 'Device or resource busy' 'refused with both entries and the one device, for all its names; a row of doctor' \
  drivers/drivers_test:'Backends.OneCamera*' drivers/drivers_test:'V4l2CameraTest.IsOneDevice*' doctor/doctor_test:'Doctor.OneCamera*'
found C.9 'escape sequences in a RoboClaw'"'"'s version, a camera'"'"'s name' 'reach the terminal' 'replaced where the text is read' \
  hal/hal_test:'Printable.*' "$drivers:Roboclaw.AVersionWithEscape*" drivers/drivers_test:'V4l2CameraTest.ANameWithEscape*'
found C.10 'the watchdog halted (SIGSTOP)' 'not noticed for 6 s of driving' 'the next command stops the wheels within command_timeout_s, names it, and starts another watchdog process' \
  "$drivers:WithWatchdog.AHaltedWatchdog*"
found C.11 'crossed motor plugs, control loops in the controller' 'the encoders'"'"' wires' 'the two motors'"'"' plugs, not the encoders'"'"', as the guide says' \
  doctor/doctor_test:'CrossedMotors.*'
found C.13 'devices where libcamera may open nothing' 'libcamera'"'"'s own ERROR and WARN lines first' 'its lines are omitted, unless LIBCAMERA_LOG_LEVELS or LIBCAMERA_LOG_FILE requests them' \
  script:tests/end_to_end/doctor.sh

# 2,000 schedules of each kind: delays, suspended programs, resets, lost bytes, a halted or killed watchdog, and all together.
step schedules env TWOCONE_SCHEDULES=12000 build/release/tests/drivers/drivers_test --gtest_filter='SerialSchedules.*'
figures=$(awk '/^schedules .*: [0-9]+ run/ {
  run += $3; wrong += $5; calls += $7; failed += $9
  for (i = 1; i <= NF; ++i) {
    if ($i == "failure" && $(i + 1) > over) over = $(i + 1)
    if ($i == "most" && $(i + 1) > turn) turn = $(i + 1)
    if ($i == "within" && $(i + 1) > missed) missed = $(i + 1)
  }
} END { printf "%d %d %d %d %.3f %.3f %.3f", run, wrong, calls, failed, over, turn, missed }' "$work/schedules.log")
read -r run wrong calls failed over turn missed <<<"$figures"
row 'random schedules of program, watchdog and firmware in simulated time' "$run, of them $wrong wrong; $failed of $calls calls failed" '1,000 at least, none wrong' \
  "$(holds "$run >= 1000 && $wrong == 0 && \"$(passed schedules)\" == \"yes\"")"
row 'schedules: wheels with power beyond command_timeout' "$turn s at most" '0.1 s' "$(holds "$run > 0 && $turn <= 0.1")"
row 'schedules: last failure after the line was in order' "$over s" '0.3 s' "$(holds "$run > 0 && $over <= 0.3")"
row 'schedules: power after a command while the watchdog is halted or dead (time-outs 0.1 to 0.5 s)' "$missed s at most" 'command_timeout_s' \
  "$(holds "$run > 0 && $missed <= 0.5")"
