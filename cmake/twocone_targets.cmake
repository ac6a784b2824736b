# SPDX-License-Identifier: Apache-2.0
# One way to make a library, a program and a test, so that no folder can forget the warnings or the alias.

function(twocone_set_up target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC 12 sees an overlap in `"a" + std::string` that is not there (its bug 105329).
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  if(TWOCONE_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${TWOCONE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${TWOCONE_SANITIZE})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # Between the sanitizers' checks GCC loses sight of what an optional holds, and warns of members never read.
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
    endif()
  endif()
endfunction()

# twocone_library(NAME SOURCES a.cpp ... HEADERS public.h ... DEPENDS twocone::hal ... PRIVATE_DEPENDS ...)
# HEADERS are the folder's API and are installed; the folder's other headers are private to it.
function(twocone_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  set(target twocone_${name})
  add_library(${target} ${ARG_SOURCES})
  add_library(twocone::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/twocone>)
  target_link_libraries(${target} PUBLIC ${ARG_DEPENDS} PRIVATE ${ARG_PRIVATE_DEPENDS})
  twocone_set_up(${target})
  install(TARGETS ${target} EXPORT twoconeTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  install(FILES ${ARG_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/twocone/${folder} COMPONENT development)
endfunction()

# What nearly every test includes, compiled once: two thirds of many a test's own time. Only for tests: a forgotten #include of the
# product shall not compile. CMAKE_DISABLE_PRECOMPILE_HEADERS turns it off.
function(twocone_precompile_for_tests)
  set(empty ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cpp)
  file(CONFIGURE OUTPUT ${empty} CONTENT "")
  add_library(twocone_tests_precompiled OBJECT ${empty})
  target_link_libraries(twocone_tests_precompiled PRIVATE Eigen3::Eigen GTest::gtest GTest::gmock)
  twocone_set_up(twocone_tests_precompiled)
  target_precompile_headers(twocone_tests_precompiled PRIVATE <Eigen/Dense> <gmock/gmock.h> <gtest/gtest.h>)
endfunction()

# twocone_test(NAME SOURCES a_test.cpp ... DEPENDS twocone::hal ... [LABEL slow] [TIMEOUT seconds])
# One label only: gtest_discover_tests of CMake 3.25 drops the time-out behind a second one.
function(twocone_test name)
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT" "SOURCES;DEPENDS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 60)
  endif()
  if(NOT ARG_LABEL)
    set(ARG_LABEL quick)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gtest_main GTest::gmock)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_definitions(${name} PRIVATE TWOCONE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  twocone_set_up(${name})
  target_precompile_headers(${name} REUSE_FROM twocone_tests_precompiled)
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS ${ARG_LABEL})
endfunction()
