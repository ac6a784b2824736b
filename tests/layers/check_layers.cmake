# SPDX-License-Identifier: Apache-2.0
# cmake -DROOT=<repository> -P check_layers.cmake
#
# Checks the allowed dependencies in ARCHITECTURE.md: compares every #include and every twocone:: link with the tables
# below and reports file, line and rule of each breach. A line that begins with // is a comment and is not checked.
cmake_minimum_required(VERSION 3.25)

# An area is a folder or, for drivers/backends, the files of that name. It may include the listed folders and headers.
# The first area that fits is used. DRIVER is the driver's own folder.
set(areas base hal vision localisation drivers/backends drivers/DRIVER
          apps/behaviours apps/config apps/estimation apps/runlog apps/runs apps/error_budget apps/report/kit apps/report apps/calibrate
          apps/compare apps/doctor apps/import apps/tradeoff apps/interface apps/twocone include bench examples)
set(drivers_api drivers/backends.h drivers/serial_diffdrive/protocol.h drivers/serial_diffdrive/serial_diffdrive.h
                drivers/sim_povray/camera_effects.h drivers/sim_povray/effects.h
                drivers/sim_povray/outline.h drivers/sim_povray/overhead.h
                drivers/sim_povray/place.h drivers/sim_povray/reflected_truth.h
                drivers/sim_povray/render_settings.h drivers/sim_povray/robot_body.h
                drivers/sim_povray/serve.h drivers/sim_povray/session_settings.h
                drivers/sim_povray/shown_camera.h drivers/sim_povray/simulation.h
                drivers/sim_povray/simulation_host.h drivers/sim_povray/verification.h)
# Folders and headers that every application may include.
set(common apps/config apps/estimation apps/runlog apps/behaviours base hal vision localisation ${drivers_api})
set(may_base base)
set(may_hal base hal)
set(may_vision base vision)
set(may_localisation base localisation vision)
set(may_drivers/backends hal drivers)
set(may_drivers/DRIVER base hal drivers/DRIVER)
# Behaviours receive values and no device. So they cannot distinguish simulation from hardware or access the truth.
set(may_apps/behaviours apps/behaviours base localisation hal/clock.h hal/diff_drive.h)
set(may_apps/config apps/config apps/behaviours base hal vision localisation ${drivers_api})
# An answer depends on images, map and rig only. So the estimation may include no driver and no run folder.
set(may_apps/estimation apps/estimation apps/config base hal/image.h hal/result.h hal/diff_drive.h hal/clock.h vision localisation)
set(may_apps/error_budget apps/error_budget apps/config apps/behaviours base localisation vision)
set(may_apps/runlog apps/runlog apps/estimation apps/config base hal vision localisation ${drivers_api})
set(may_apps/runs apps/runs ${common})
# What the tables, pages and plots of all tools are made of. It knows poses and maps, and no result of any tool.
set(may_apps/report/kit apps/report/kit apps/config apps/runlog/run_data.h apps/runlog/storage/disk.h base hal drivers/sim_povray/overhead.h)
set(may_apps/report apps/report apps/error_budget ${common})
set(may_apps/calibrate apps/calibrate ${common})
set(may_apps/compare apps/compare apps/import/motion.h apps/report/kit apps/calibrate apps/runs ${common})
set(may_apps/doctor apps/doctor ${common})
set(may_apps/import apps/import apps/runlog apps/estimation/method.h apps/config base hal/image.h localisation)
set(may_apps/tradeoff apps/tradeoff apps/report/kit ${common})
set(may_apps/twocone apps ${common})
set(may_bench bench apps drivers base hal vision localisation tests/support)
# The public interface stands alone; other programs see nothing else.
set(may_include twocone)
set(may_apps/interface apps/interface apps/runs include twocone ${common})
set(may_examples examples twocone)

# Headers of other projects that are forbidden in an area, as regular expressions for the text between the brackets.
set(pure "fstream|iostream|cstdio|filesystem|thread|future|mutex|condition_variable|atomic|chrono|ctime|unistd.h|sys/.*")
set(never_hal "opencv2/.*|Eigen/.*|yaml-cpp/.*|nlohmann/.*")
set(never_vision "${pure}|yaml-cpp/.*|nlohmann/.*|opencv2/(highgui|imgcodecs|videoio).*")
set(never_localisation "${pure}|yaml-cpp/.*|nlohmann/.*|opencv2/(highgui|imgcodecs|videoio).*")
set(never_drivers/backends "yaml-cpp/.*")
set(never_drivers/DRIVER "yaml-cpp/.*")
set(never_apps/behaviours "${pure}|yaml-cpp/.*|opencv2/.*")

# The folder of each target.
set(home_base base)
set(home_hal hal)
set(home_vision vision)
set(home_localisation localisation)
set(home_backends drivers/backends.h)
foreach(app behaviours config estimation runlog runs error_budget report calibrate compare doctor tradeoff)
  set(home_${app} apps/${app})
endforeach()

set(home_importer apps/import)
set(home_twocone twocone)

if(NOT IS_DIRECTORY "${ROOT}")
  message(FATAL_ERROR "ROOT is '${ROOT}', must be the repository's folder")
endif()

set(breaches 0)
macro(breach file text complaint)
  # The line number is determined only for breaches, because CMake has no quick way to count lines.
  file(READ "${ROOT}/${file}" content)
  string(FIND "${content}" "${text}" at)
  string(SUBSTRING "${content}" 0 ${at} before)
  string(REGEX REPLACE "[^\n]" "" before "${before}")
  string(LENGTH "${before}" line)
  math(EXPR line "${line} + 1")
  math(EXPR breaches "${breaches} + 1")
  message("${file}:${line}: ${complaint}")
endmacro()

# Sets `area`, empty if there is none, `allowed` and `forbidden` for a file.
function(find_area file)
  set(area "")
  foreach(candidate IN LISTS areas)
    string(REPLACE "/DRIVER" "/([^/]+)" pattern "${candidate}")
    if(candidate STREQUAL "drivers/backends")
      set(pattern "drivers/(backends[.][a-z]+|CMakeLists.txt)$")
    else()
      string(APPEND pattern "/")
    endif()
    if(file MATCHES "^${pattern}")
      set(area "${candidate}")
      set(driver "${CMAKE_MATCH_1}")
      break()
    endif()
  endforeach()
  string(REPLACE "DRIVER" "${driver}" allowed "${may_${area}}")
  set(allowed "${allowed}" PARENT_SCOPE)
  set(forbidden "${never_${area}}" PARENT_SCOPE)
  string(REPLACE "DRIVER" "${driver}" area "${area}")
  set(area "${area}" PARENT_SCOPE)
endfunction()

# Sets `ok` if `path`, a header or a target's folder, is allowed. A target may be linked if at least one of its headers
# may be included.
function(is_allowed path is_target)
  set(ok FALSE PARENT_SCOPE)
  foreach(entry IN LISTS allowed)
    string(FIND "${path}/" "${entry}/" within)
    string(FIND "${entry}/" "${path}/" around)
    if(within EQUAL 0 OR (is_target AND around EQUAL 0))
      set(ok TRUE PARENT_SCOPE)
    endif()
  endforeach()
endfunction()

set(patterns "")
foreach(folder include base hal vision localisation drivers apps bench examples)
  list(APPEND patterns "${ROOT}/${folder}/*.h" "${ROOT}/${folder}/*.cpp" "${ROOT}/${folder}/CMakeLists.txt")
endforeach()
file(GLOB_RECURSE files RELATIVE "${ROOT}" ${patterns})
list(SORT files)
# This file only lists the folders.
list(REMOVE_ITEM files apps/CMakeLists.txt)

set(checked 0)
foreach(file IN LISTS files)
  find_area("${file}")
  if(area STREQUAL "")
    breach("${file}" "" "this folder has no rule, add one to tests/layers/check_layers.cmake")
    continue()
  endif()
  string(JOIN ", " rule ${allowed})
  if(file MATCHES "CMakeLists.txt$")
    file(STRINGS "${ROOT}/${file}" lines REGEX "^[^#]*twocone::")
    foreach(line IN LISTS lines)
      string(REGEX MATCHALL "twocone::[a-z0-9_]+" targets "${line}")
      foreach(target IN LISTS targets)
        math(EXPR checked "${checked} + 1")
        string(REPLACE "twocone::" "" name "${target}")
        set(home "drivers/${name}")
        if(DEFINED home_${name})
          set(home "${home_${name}}")
        endif()
        is_allowed("${home}" TRUE)
        if(NOT ok)
          breach("${file}" "${line}" "${area} may link only: ${rule}, not ${target} (${home})")
        endif()
      endforeach()
    endforeach()
    continue()
  endif()
  file(STRINGS "${ROOT}/${file}" lines REGEX "^[ \t]*#[ \t]*include")
  foreach(line IN LISTS lines)
    math(EXPR checked "${checked} + 1")
    if(line MATCHES "include[ \t]*\"([^\"]+)\"")
      set(header "${CMAKE_MATCH_1}")
      is_allowed("${header}" FALSE)
      if(NOT ok)
        breach("${file}" "${line}" "${area} may include only: ${rule}, not \"${header}\"")
      endif()
    elseif(line MATCHES "include[ \t]*<([^>]+)>")
      set(header "${CMAKE_MATCH_1}")
      if(forbidden AND header MATCHES "^(${forbidden})$")
        breach("${file}" "${line}" "${area} must do without <${header}>")
      endif()
    else()
      breach("${file}" "${line}" "an include that this check cannot read: ${line}")
    endif()
  endforeach()
endforeach()

if(checked EQUAL 0)
  message(FATAL_ERROR "${ROOT}: no include was found: the check would pass whatever there is")
endif()
if(breaches GREATER 0)
  message(FATAL_ERROR "${breaches} of ${checked} includes and links break the layers")
endif()
message("${checked} includes and links keep to the layers")
