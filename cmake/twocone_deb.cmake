# SPDX-License-Identifier: Apache-2.0
# `cpack` in a build folder makes the Debian packages with the binaries that were built and tested there: one for each
# component of twocone_install.cmake. With SOURCE_DATE_EPOCH, the same build gives the same bytes.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME twocone)
set(CPACK_PACKAGE_CONTACT "${TWOCONE_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
# The binaries are neither stripped nor linked again, so they are those that the tests ran.
set(CPACK_STRIP_FILES OFF)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(all_text "Part of a robot that carries two conical mirrors, one above the other: ranges
to landmarks from the difference between the two views, position and heading
from the ranges and bearings of landmarks on a map.
")
# twocone_deb(COMPONENT PACKAGE SECTION section SUMMARY text DESCRIPTION text [DEPENDS ...] [RECOMMENDS ...] [SUGGESTS ...]
#             [SCRIPTS file...])
function(twocone_deb component package)
  cmake_parse_arguments(ARG "" "SECTION;SUMMARY;DESCRIPTION;DEPENDS;RECOMMENDS;SUGGESTS" "SCRIPTS" ${ARGN})
  string(TOUPPER ${component} upper)
  set(all ${CPACK_COMPONENTS_ALL} ${component})
  set(CPACK_COMPONENTS_ALL ${all} PARENT_SCOPE)
  set(prefix CPACK_DEBIAN_${upper})
  set(${prefix}_PACKAGE_NAME ${package} PARENT_SCOPE)
  set(${prefix}_PACKAGE_SECTION ${ARG_SECTION} PARENT_SCOPE)
  set(${prefix}_DESCRIPTION "${ARG_SUMMARY}
${all_text}${ARG_DESCRIPTION}" PARENT_SCOPE)
  set(${prefix}_PACKAGE_DEPENDS "${ARG_DEPENDS}" PARENT_SCOPE)
  set(${prefix}_PACKAGE_RECOMMENDS "${ARG_RECOMMENDS}" PARENT_SCOPE)
  set(${prefix}_PACKAGE_SUGGESTS "${ARG_SUGGESTS}" PARENT_SCOPE)
  set(${prefix}_PACKAGE_CONTROL_EXTRA "${ARG_SCRIPTS}" PARENT_SCOPE)
  # What Debian requires of every package.
  set(documents share/doc/${package})
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/deb/copyright ${PROJECT_BINARY_DIR}/changelog.gz DESTINATION ${documents}
          COMPONENT ${component})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/deb/lintian-overrides.in ${PROJECT_BINARY_DIR}/lintian/${package} @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/lintian/${package} DESTINATION share/lintian/overrides COMPONENT ${component})
endfunction()
set(same "(= ${PROJECT_VERSION})")
set(scripts ${PROJECT_SOURCE_DIR}/cmake/deb)

# The simulation runs POV-Ray as a program; a real robot does not need it.
twocone_deb(program twocone SECTION science
  SUMMARY "robot that sees all around with two cone mirrors, simulated or real"
  DESCRIPTION "This package has the program. It drives a real robot (V4L2 or libcamera
cameras, motor controllers of ros_arduino_bridge, RoboClaw or Create 2) and one
that is simulated by POV-Ray."
  RECOMMENDS "povray, povray-includes" SUGGESTS "python3-twocone, twocone-rosbag"
  SCRIPTS ${scripts}/twocone/postinst)
if(TWOCONE_HAVE_ROSBAG)
  twocone_deb(rosbag twocone-rosbag SECTION science
    SUMMARY "robot that sees all around with two cone mirrors, bags of ROS 1"
    DESCRIPTION "This package has the program with which twocone import reads bags of ROS 1."
    DEPENDS "twocone ${same}")
endif()
set(interface_version ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
twocone_deb(runtime libtwocone${interface_version} SECTION libs
  SUMMARY "robot that sees all around with two cone mirrors, shared libraries"
  DESCRIPTION "This package has the shared libraries of the C++ interface. A robot with
libcamera's cameras also needs the package twocone."
  RECOMMENDS "twocone ${same}"
  SCRIPTS ${scripts}/libtwocone/triggers)
twocone_deb(development libtwocone-dev SECTION libdevel
  SUMMARY "robot that sees all around with two cone mirrors, C++ interface"
  DESCRIPTION "This package has headers, and files for CMake and pkg-config."
  DEPENDS "libtwocone${interface_version} ${same}" SUGGESTS "twocone")
if(TWOCONE_HAVE_PYTHON)
  math(EXPR next_python "${Python_VERSION_MINOR} + 1")
  twocone_deb(python python3-twocone SECTION python
    SUMMARY "robot that sees all around with two cone mirrors, Python package"
    DESCRIPTION "This package has the Python package twocone: robots, frames as NumPy arrays,
the localiser, and the program's tools as functions."
    DEPENDS "python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next_python}), python3-numpy, twocone ${same}"
    RECOMMENDS "povray, povray-includes"
    SCRIPTS ${scripts}/python3-twocone/postinst ${scripts}/python3-twocone/prerm)
endif()
set(CPACK_INSTALL_CMAKE_PROJECTS "${PROJECT_BINARY_DIR};${PROJECT_NAME};ALL;/")

# The source: `cmake/package.sh` makes it of a commit, because a build folder may hold anything.
include(CPack)
