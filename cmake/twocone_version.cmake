# SPDX-License-Identifier: Apache-2.0
# Runs at every build, so that a result names the source that made it: writes version.cpp again when the commit has changed.
# cmake -D SOURCE=... -D IN=... -D OUT=... -D PROJECT_VERSION=... (and the compiler's variables) -P twocone_version.cmake
set(TWOCONE_COMMIT unknown)
find_program(GIT git)
file(READ ${SOURCE}/cmake/commit archived) # of a source that `git archive` made
if(archived MATCHES "^[0-9a-f]+")
  string(SUBSTRING ${archived} 0 10 TWOCONE_COMMIT)
elseif(GIT)
  execute_process(COMMAND ${GIT} rev-parse --short=10 HEAD WORKING_DIRECTORY ${SOURCE}
                  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(TWOCONE_COMMIT ${commit})
    execute_process(COMMAND ${GIT} status --porcelain --untracked-files=no WORKING_DIRECTORY ${SOURCE}
                    OUTPUT_VARIABLE changes ERROR_QUIET)
    if(changes)
      string(APPEND TWOCONE_COMMIT "+")
    endif()
  endif()
endif()
configure_file(${IN} ${OUT} @ONLY)
