# SPDX-License-Identifier: Apache-2.0
# `cpack` in a build folder makes twocone_VERSION_ARCHITECTURE.deb with the binary that was built and tested there.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME twocone)
set(CPACK_PACKAGE_CONTACT "${TWOCONE_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "robot that sees all around with two cone mirrors, simulated or real")
set(CPACK_PACKAGE_DESCRIPTION
    "Runs a robot that carries two conical mirrors, one above the other: ranges
to landmarks from the difference between the two views, position and heading
from the ranges and bearings of landmarks on a map.
The same program drives a real robot (V4L2 or libcamera cameras, motor
controllers of ros_arduino_bridge, RoboClaw or Create 2) and one that is
simulated by POV-Ray.")
# The binary is neither stripped nor linked again, so it is the one that the tests ran.
set(CPACK_STRIP_FILES OFF)
set(CPACK_INSTALL_CMAKE_PROJECTS "${PROJECT_BINARY_DIR};${PROJECT_NAME};program;/")
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# The simulation runs POV-Ray as a program; a real robot does not need it.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "povray, povray-includes")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/deb/postinst)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
