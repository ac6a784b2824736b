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
file(COPY ${SOURCE}/examples/controller DESTINATION ${WORK})
run(${CMAKE_COMMAND} -S ${WORK}/controller -B ${WORK}/build -G Ninja -D CMAKE_PREFIX_PATH=${WORK}/installed
    -D CMAKE_BUILD_TYPE=${CONFIG} -D "CMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build ${WORK}/build)

# The robot and the scene are those of the installed package too. A third of a second at 3 and 4 rad/s, in steps of the encoder.
run(${WORK}/build/controller ${WORK}/installed/share/twocone/robots/lab_sim.yaml)
if(NOT output MATCHES "t 0.333 s, wheels 0.99[0-9] 1.33[0-9] rad, lower view 640 x 480")
  message(FATAL_ERROR "controller said:\n${output}")
endif()
execute_process(COMMAND ${WORK}/installed/bin/twocone --version OUTPUT_VARIABLE version RESULT_VARIABLE failed)
if(failed OR NOT version MATCHES "^twocone [0-9.]+ ")
  message(FATAL_ERROR "the installed twocone says: ${version}")
endif()

# What is installed, and so packed, is the very file that was built and tested.
file(SHA256 ${BUILD}/twocone built)
file(SHA256 ${WORK}/installed/bin/twocone installed)
if(NOT built STREQUAL installed)
  message(FATAL_ERROR "the installed twocone has other bytes than the built one")
endif()
# The Debian package holds the component `program`: all that a robot needs, and no library to build with.
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/program --component program)
foreach(file bin/twocone share/twocone/robots/lab_sim.yaml share/twocone/scenes/lab.map.yaml share/man/man1/twocone.1.gz
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
