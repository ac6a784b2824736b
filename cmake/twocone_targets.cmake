# SPDX-License-Identifier: Apache-2.0
# Functions that make a library, a program or a test, so that every folder sets the warnings and the alias.

function(twocone_set_up target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC 12 wrongly warns of an overlap in `"a" + std::string` (its bug 105329).
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # A source that is compiled together with others looks like a header to GCC, and in a header a member of a type of the
    # anonymous namespace would be wrong.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
  if(TWOCONE_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${TWOCONE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${TWOCONE_SANITIZE})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # With the sanitizers' checks GCC loses track of an optional's state, and warns of members that are never read.
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
      if(TWOCONE_SANITIZE MATCHES "thread")
        target_compile_options(${target} PRIVATE -Wno-tsan) # Boost.Asio has fences, of which the sanitizer knows nothing.
      endif()
    endif()
  endif()
endfunction()

# twocone_precompile(TARGET product|tests): compiles headers that most files include only once, which saves a quarter of a
# build. This is done only in presets dev and asan: the other presets, and ./test.sh --lint, detect a missing #include.
function(twocone_precompile target of)
  if(NOT TWOCONE_PRECOMPILE)
    return()
  endif()
  set(owner twocone_precompiled_for_${of})
  if(NOT TARGET ${owner})
    set(empty ${PROJECT_BINARY_DIR}/${owner}.cpp)
    file(CONFIGURE OUTPUT ${empty} CONTENT "")
    add_library(${owner} OBJECT ${empty})
    target_link_libraries(${owner} PRIVATE Eigen3::Eigen fmt::fmt opencv_core)
    twocone_set_up(${owner})
    target_precompile_headers(${owner} PRIVATE
      <array> <chrono> <filesystem> <fstream> <functional> <future> <map> <memory> <optional> <span> <sstream> <string> <thread>
      <variant> <vector> <Eigen/Dense> <fmt/format.h> <opencv2/core.hpp>)
    if(of STREQUAL "tests")
      target_link_libraries(${owner} PRIVATE GTest::gtest GTest::gmock)
      target_precompile_headers(${owner} PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
    endif()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${owner})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC collects its garbage less often: a tenth of the time for some 200 MB more.
    target_compile_options(${target} PRIVATE "SHELL:--param ggc-min-heapsize=524288")
  endif()
  # GCC uses precompiled headers only if all macros are the same, and fmt defines one.
  target_link_libraries(${target} PRIVATE fmt::fmt)
endfunction()

# twocone_library(NAME SOURCES a.cpp ... HEADERS public.h ... DEPENDS twocone::hal ... PRIVATE_DEPENDS ...)
# HEADERS are the folder's API; its other headers are private to it. None is installed: other programs use
# include/twocone.
function(twocone_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  set(target twocone_${name})
  add_library(${target} ${ARG_SOURCES})
  add_library(twocone::${name} ALIAS ${target})
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PUBLIC ${ARG_DEPENDS} PRIVATE ${ARG_PRIVATE_DEPENDS})
  twocone_set_up(${target})
  twocone_precompile(${target} product)
endfunction()

# The folder of modules has no multiarch part, because a module is found relative to the program, wherever that is installed.
set(TWOCONE_MODULES lib/twocone)

# twocone_module(NAME [PROGRAM] FOR library SOURCES a.cpp ... DEPENDS ... [COMPONENT component])
# A shared library, or a program, that only the named library loads or runs (base/module.h), as TWOCONE_<NAME>_MODULE or
# TWOCONE_<NAME>_PROGRAM, so that twocone starts without what few robots need. Building what may use it also builds it.
function(twocone_module name)
  cmake_parse_arguments(ARG "PROGRAM" "FOR;COMPONENT" "SOURCES;DEPENDS" ${ARGN})
  if(NOT ARG_COMPONENT)
    set(ARG_COMPONENT program)
  endif()
  set(target twocone_${name})
  string(TOUPPER ${name} upper)
  # As the SOVERSION of the public interface: two installed versions must not load each other's module.
  set(file twocone_${name}_${PROJECT_VERSION_MAJOR}_${PROJECT_VERSION_MINOR})
  if(ARG_PROGRAM)
    add_executable(${target} ${ARG_SOURCES})
    set_target_properties(${target} PROPERTIES OUTPUT_NAME ${file} RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/${TWOCONE_MODULES})
    target_compile_definitions(twocone_${ARG_FOR} PRIVATE TWOCONE_${upper}_PROGRAM="${file}")
    install(TARGETS ${target} RUNTIME DESTINATION ${TWOCONE_MODULES} COMPONENT ${ARG_COMPONENT})
  else()
    add_library(${target} MODULE ${ARG_SOURCES})
    set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${file} SUFFIX .so
                          LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/${TWOCONE_MODULES})
    target_compile_definitions(twocone_${ARG_FOR} PRIVATE TWOCONE_${upper}_MODULE="${file}.so")
    install(TARGETS ${target} LIBRARY DESTINATION ${TWOCONE_MODULES} COMPONENT ${ARG_COMPONENT})
  endif()
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE ${ARG_DEPENDS})
  twocone_set_up(${target})
  add_dependencies(twocone_${ARG_FOR} ${target})
endfunction()

# twocone_test(NAME SOURCES a_test.cpp ... DEPENDS twocone::hal ... [LABEL slow] [TIMEOUT seconds])
# A test has only one label: gtest_discover_tests of CMake 3.25 drops the time-out after a second label. With a sanitizer
# TIMEOUT does not count, since a process runs many tests.
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
  twocone_precompile(${name} tests)
  if(NOT TWOCONE_SANITIZE)
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS ${ARG_LABEL})
    return()
  endif()
  # A program with sanitizers needs up to half a second to start. So ctest starts a program 12 times, each time for every
  # twelfth test, and not once for each test.
  foreach(shard RANGE 11)
    add_test(NAME ${name}.shard_${shard} COMMAND ${name})
    set_tests_properties(${name}.shard_${shard} PROPERTIES ENVIRONMENT "GTEST_TOTAL_SHARDS=12;GTEST_SHARD_INDEX=${shard}"
      TIMEOUT 1800 LABELS ${ARG_LABEL})
  endforeach()
endfunction()
