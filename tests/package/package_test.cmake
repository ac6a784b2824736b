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

file(GLOB_RECURSE cmake_files ${WORK}/installed/*.cmake)
foreach(file ${cmake_files})
  file(READ ${file} text)
  string(FIND "${text}" "${SOURCE}/" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "${file} names the source tree")
  endif()
endforeach()
