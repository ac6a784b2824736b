# SPDX-License-Identifier: Apache-2.0
# Catches a header or a dependency that is not installed, and paths of the source tree in the installed package.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(failed)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed)
# Both examples, built from what is installed and nothing else; robot and scene are those of the installed package, too.
foreach(example controller waypoints)
  file(COPY ${SOURCE}/examples/${example} DESTINATION ${WORK})
  run(${CMAKE_COMMAND} -S ${WORK}/${example} -B ${WORK}/build-${example} -G Ninja -D CMAKE_PREFIX_PATH=${WORK}/installed
      -D CMAKE_BUILD_TYPE=${CONFIG} -D "CMAKE_CXX_FLAGS=${FLAGS}")
  run(${CMAKE_COMMAND} --build ${WORK}/build-${example})
endforeach()
run(${WORK}/build-controller/controller ${WORK}/installed/share/twocone/robots/lab_sim.yaml)
# It begins at the map's origin, and each frame has a range to each landmark and a position.
if(NOT output MATCHES "^red 2[.]4[0-9]+ m, .*at [(]-?0[.]000, -?0[.]000[)] m\n")
  message(FATAL_ERROR "controller printed:\n${output}")
endif()
run(${WORK}/build-waypoints/waypoints ${WORK}/installed/share/twocone/robots/lab_sim.yaml 24)
if(NOT output MATCHES "^24 frames, [0-9]+ waypoints reached, 0 frames without a track\noff the path: rms [0-9.]+ mm")
  message(FATAL_ERROR "waypoints printed:\n${output}")
endif()

# The interface and nothing else is installed as headers. The localisation alone asks for no camera library.
file(GLOB_RECURSE headers RELATIVE ${WORK}/installed/include ${WORK}/installed/include/*)
if(NOT headers STREQUAL "twocone/localisation.h;twocone/twocone.h;twocone/types.h")
  message(FATAL_ERROR "installed headers: ${headers}")
endif()
file(WRITE ${WORK}/alone/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(alone LANGUAGES CXX)
find_package(twocone 1.0 REQUIRED COMPONENTS localisation)
if(TARGET twocone::twocone)
  message(FATAL_ERROR \"component localisation brings the robot\")
endif()
add_executable(alone alone.cpp)
target_compile_features(alone PRIVATE cxx_std_20)
target_link_libraries(alone PRIVATE twocone::localisation)
")
file(WRITE ${WORK}/alone/alone.cpp "#include <array>
#include <cstdio>
#include <twocone/localisation.h>
int main() {
  const std::array<twocone::LandmarkObservation, 3> seen{{{3, 0, 3, 0, 0.01, 0.01}, {0, 4, 4, 1.5707963, 0.01, 0.01}, {-5, 0, 5, 3.1415926, 0.01, 0.01}}};
  const auto answer = twocone::locate(seen);
  return answer.pose ? std::printf(\"%.2f %.2f\\n\", answer.pose->x_m + 1, answer.pose->y_m + 1), 0 : 1;
}
")
run(${CMAKE_COMMAND} -S ${WORK}/alone -B ${WORK}/build-alone -G Ninja -D CMAKE_PREFIX_PATH=${WORK}/installed -D "CMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build ${WORK}/build-alone)
run(${WORK}/build-alone/alone)
if(NOT output STREQUAL "1.00 1.00\n")
  message(FATAL_ERROR "the localisation alone printed: ${output}")
endif()
run(ldd ${WORK}/build-alone/alone)
if(output MATCHES "camera|turbojpeg|serialport|libode")
  message(FATAL_ERROR "the localisation alone links:\n${output}")
endif()
# The same by pkg-config. The installation is not where it was configured, so this also catches a path that cannot move.
file(GLOB_RECURSE pc ${WORK}/installed/*/twocone.pc)
if(NOT pc)
  message(FATAL_ERROR "twocone.pc is not installed")
endif()
get_filename_component(pc_folder "${pc}" DIRECTORY)
get_filename_component(libraries "${pc_folder}" DIRECTORY)
set(compile ${CXX} -std=c++20)
separate_arguments(flags UNIX_COMMAND "${FLAGS}")
list(APPEND compile ${flags})
if(SANITIZE)
  list(APPEND compile -fsanitize=${SANITIZE})
endif()
file(WRITE ${WORK}/alone/robot.cpp "#include <cstdio>
#include <twocone/twocone.h>
int main(int, char** words) { twocone::RobotDescription robot(words[1]); std::puts(\"read\"); }
")
# All of the interface of version 1.0 compiles (docs/compatibility.md).
file(COPY ${SOURCE}/tests/package/interface_1_0.cpp DESTINATION ${WORK}/alone)
foreach(program_of "alone;twocone_localisation;1.00 1.00\n" "robot;twocone;read\n" "interface_1_0;twocone;interface 1.0\n")
  list(POP_FRONT program_of program library expected)
  run(${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${pc_folder} ${PKG_CONFIG} --cflags --libs "${library} >= 1.0" twocone_localisation)
  separate_arguments(flags UNIX_COMMAND "${output}")
  run(${compile} ${WORK}/alone/${program}.cpp -o ${WORK}/${program}-by-pkg-config ${flags})
  run(${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${libraries} ${WORK}/${program}-by-pkg-config
      ${WORK}/installed/share/twocone/robots/lab_sim.yaml)
  if(NOT output STREQUAL expected)
    message(FATAL_ERROR "${program}, built by pkg-config, printed: ${output}")
  endif()
endforeach()

execute_process(COMMAND ${WORK}/installed/bin/twocone --version OUTPUT_VARIABLE version RESULT_VARIABLE failed)
if(failed OR NOT version MATCHES "^twocone [0-9.]+ ")
  message(FATAL_ERROR "the installed twocone says: ${version}")
endif()
# Two installed versions must not load each other's module.
string(REGEX REPLACE "^twocone ([0-9]+)[.]([0-9]+).*" "_\\1_\\2" ending "${version}")
file(GLOB modules ${WORK}/installed/lib/twocone/*)
foreach(module ${modules})
  if(NOT module MATCHES "${ending}([.]so)?$")
    message(FATAL_ERROR "${module} does not end in ${ending} or ${ending}.so")
  endif()
endforeach()

# The installed and packed file must be the file that was built and tested.
file(SHA256 ${BUILD}/twocone built)
file(SHA256 ${WORK}/installed/bin/twocone installed)
if(NOT built STREQUAL installed)
  message(FATAL_ERROR "the installed twocone has other bytes than the built one")
endif()
# The Debian package contains the component `program`: everything that a robot needs, and no library for developers.
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/program --component program)
foreach(file bin/twocone share/twocone/robots/lab_sim.yaml share/twocone/scenes/lab.map.yaml share/man/man1/twocone.1.gz share/man/man1/twocone-run.1.gz share/bash-completion/completions/twocone
             lib/udev/rules.d/70-twocone.rules)
  if(NOT EXISTS ${WORK}/program/${file})
    message(FATAL_ERROR "component program lacks ${file}")
  endif()
endforeach()
file(GLOB_RECURSE for_developers ${WORK}/program/*.a ${WORK}/program/*.h ${WORK}/program/*.cmake)
if(for_developers)
  message(FATAL_ERROR "component program holds ${for_developers}")
endif()

file(GLOB_RECURSE cmake_files ${WORK}/installed/*.cmake)
foreach(file ${cmake_files})
  file(READ ${file} text)
  string(FIND "${text}" "${SOURCE}/" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "${file} names the source tree")
  endif()
endforeach()
