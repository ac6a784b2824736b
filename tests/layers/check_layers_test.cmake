# SPDX-License-Identifier: Apache-2.0
# Shows that check_layers.cmake can fail. The invented tree bad/ breaks every rule once, beside lines that keep the
# rules. The check must report each breach with file, line and rule, and nothing else.
set(check ${CMAKE_CURRENT_LIST_DIR}/check_layers.cmake)

execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${CMAKE_CURRENT_LIST_DIR}/bad -P ${check}
                RESULT_VARIABLE result ERROR_VARIABLE report OUTPUT_QUIET TIMEOUT 60)
if(result EQUAL 0)
  message(FATAL_ERROR "the bad tree passed")
endif()
string(REGEX MATCHALL "[^\n]+:[0-9]+: [^\n]+" breaches "${report}")

set(files_rule "apps/config, apps/behaviours, base, hal, vision, localisation, drivers/backends.h, drivers/serial_diffdrive/protocol.h, drivers/serial_diffdrive/serial_diffdrive.h, drivers/sim_povray/effects.h, drivers/sim_povray/pixel_truth.h, drivers/sim_povray/place.h, drivers/sim_povray/scene_geometry.h, drivers/sim_povray/scene_views.h, drivers/sim_povray/session_settings.h, drivers/sim_povray/simulation.h, drivers/sim_povray/simulation_host.h, drivers/v4l2_camera/loopback.h")
set(behaviours_rule "apps/behaviours, base, localisation, vision/beam.h, hal/clock.h, hal/diff_drive.h")
set(tradeoff_rule "apps/tradeoff, apps/report/kit, apps/web/document.h, apps/config, apps/estimation, apps/runlog, apps/behaviours, base, hal, vision, localisation, drivers/backends.h, drivers/serial_diffdrive/protocol.h, drivers/serial_diffdrive/serial_diffdrive.h, drivers/sim_povray/effects.h, drivers/sim_povray/pixel_truth.h, drivers/sim_povray/place.h, drivers/sim_povray/scene_geometry.h, drivers/sim_povray/scene_views.h, drivers/sim_povray/session_settings.h, drivers/sim_povray/simulation.h, drivers/sim_povray/simulation_host.h, drivers/v4l2_camera/loopback.h")
set(expected
  "apps/behaviours/CMakeLists.txt:2: apps/behaviours may link only: ${behaviours_rule}, not twocone::one (drivers/one)"
  "apps/behaviours/cheats.cpp:3: apps/behaviours may include only: ${behaviours_rule}, not \"hal/robot.h\""
  "apps/config/reaches_inside.cpp:3: apps/config may include only: ${files_rule}, not \"drivers/sim_povray/world/world.h\""
  "apps/config/reaches_inside.cpp:4: apps/config may include only: ${files_rule}, not \"robot_file.h\""
  "apps/config/reaches_inside.cpp:5: an include that this check cannot read: #include ROBOT_FILE"
  "apps/config/reaches_inside.cpp:6: apps/config must do without <opencv2/imgcodecs.hpp>"
  "apps/newcomer/anything.cpp:1: this folder has no rule, add one to tests/layers/check_layers.cmake"
  "apps/tradeoff/reaches_inside.cpp:3: apps/tradeoff may include only: ${tradeoff_rule}, not \"apps/report/report.h\""
  "drivers/backends.cpp:4: drivers/backends may include only: hal, drivers, not \"apps/config/robot_file.h\""
  "drivers/one/reads_yaml.cpp:5: drivers/one must do without <yaml-cpp/yaml.h>"
  "drivers/two/knows_one.cpp:2: drivers/two may include only: base, hal, drivers/two, not \"drivers/one/one.h\""
  "hal/looks_up.cpp:5: hal may include only: base, hal, not \"vision/mirror_view.h\""
  "hal/names_a_library.h:2: hal must do without <opencv2/core.hpp>"
  "localisation/CMakeLists.txt:4: localisation may link only: base, localisation, vision, not twocone::hal (hal)"
  "localisation/asks_a_device.h:3: localisation may include only: base, localisation, vision, not \"hal/camera.h\""
  "vision/has_a_clock.cpp:3: vision must do without <chrono>")
if(NOT breaches STREQUAL expected)
  string(REPLACE ";" "\n" breaches "${breaches}")
  string(REPLACE ";" "\n" expected "${expected}")
  message(FATAL_ERROR "reported:\n${breaches}\nexpected:\n${expected}")
endif()

# Catches a check that looks in the wrong place and reports nothing.
execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${CMAKE_CURRENT_LIST_DIR} -P ${check}
                RESULT_VARIABLE result ERROR_VARIABLE report OUTPUT_QUIET TIMEOUT 60)
string(REGEX REPLACE "[ \n]+" " " report "${report}")  # CMake breaks the lines of a message where the tree's path ends
if(result EQUAL 0 OR NOT report MATCHES "no include was found")
  message(FATAL_ERROR "a folder without sources passed, or failed for another reason:\n${report}")
endif()
