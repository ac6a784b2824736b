# SPDX-License-Identifier: Apache-2.0
# Components, each a Debian package (twocone_deb.cmake): `program` holds the files that a robot needs; `rosbag` the program
# for bags of ROS 1; `runtime` the shared libraries of the public interface; `development` its headers, and the files for
# find_package(twocone) and pkg-config; `python` the Python package.
foreach(component twocone localisation)
  install(EXPORT twoconeTargets-${component} NAMESPACE twocone:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone
          COMPONENT development)
endforeach()
# The files for pkg-config find the installation relative to their own folder, so that it can be moved. A folder that was
# configured as an absolute path stays where it is.
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(pc_prefix ${CMAKE_INSTALL_PREFIX})
else()
  file(RELATIVE_PATH pc_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  string(REGEX REPLACE "^(.*)/$" "\${pcfiledir}/\\1" pc_prefix ${pc_prefix})
endif()
foreach(folder LIBDIR INCLUDEDIR)
  set(pc_${folder} ${CMAKE_INSTALL_${folder}})
  if(NOT IS_ABSOLUTE "${pc_${folder}}")
    string(PREPEND pc_${folder} "\${prefix}/")
  endif()
endforeach()
set(pc_description_twocone "${PROJECT_DESCRIPTION}")
set(pc_description_twocone_localisation "Position and heading of a robot from ranges and bearings of landmarks")
foreach(pc_library twocone twocone_localisation)
  set(pc_description "${pc_description_${pc_library}}")
  configure_file(cmake/twocone.pc.in ${PROJECT_BINARY_DIR}/${pc_library}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${pc_library}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endforeach()
configure_package_config_file(cmake/twoconeConfig.cmake.in ${PROJECT_BINARY_DIR}/twoconeConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/twoconeConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/twoconeConfig.cmake ${PROJECT_BINARY_DIR}/twoconeConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone COMPONENT development)

# The folders are as in the source tree, so that robots/lab_sim.yaml finds ../scenes/lab.map.yaml.
install(DIRECTORY robots scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/twocone COMPONENT program)
install(FILES cmake/deb/70-twocone.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES README.md ARCHITECTURE.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program
        PATTERN evidence EXCLUDE PATTERN man EXCLUDE PATTERN *.sh EXCLUDE PATTERN *.pov EXCLUDE PATTERN *.inc EXCLUDE)

install(FILES cmake/completion.bash RENAME twocone DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)

# Debian requires these files compressed. This happens at configure time, because an install must not need a build.
file(STRINGS CHANGELOG.md releases REGEX "^## \\[[0-9]")
list(GET releases 0 release)
string(REGEX MATCH "^## \\[${PROJECT_VERSION}\\] - ([0-9]+-[0-9]+-[0-9]+)$" release "${release}")
if(NOT release)
  message(FATAL_ERROR "the newest release in CHANGELOG.md is not '## [${PROJECT_VERSION}] - YEAR-MONTH-DAY'")
endif()
set(TWOCONE_DATE ${CMAKE_MATCH_1})
execute_process(COMMAND ${CMAKE_COMMAND} -E env LC_ALL=C date -u -d ${TWOCONE_DATE} -R OUTPUT_VARIABLE TWOCONE_MAIL_DATE
                OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(TWOCONE_MAINTAINER "twocone <twocone@localhost>" CACHE STRING "Maintainer of the Debian package: NAME <ADDRESS>")
configure_file(cmake/deb/changelog.in ${PROJECT_BINARY_DIR}/changelog @ONLY)
find_program(GZIP gzip REQUIRED)
function(twocone_compress file)
  execute_process(COMMAND ${GZIP} -9nc ${file} OUTPUT_FILE ${file}.gz COMMAND_ERROR_IS_FATAL ANY)
endfunction()
twocone_compress(${PROJECT_BINARY_DIR}/changelog)
file(GLOB pages CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/man/*.1)
foreach(page ${pages})
  get_filename_component(name ${page} NAME)
  configure_file(${page} ${PROJECT_BINARY_DIR}/man/${name} @ONLY)
  twocone_compress(${PROJECT_BINARY_DIR}/man/${name})
  install(FILES ${PROJECT_BINARY_DIR}/man/${name}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
endforeach()

include(twocone_deb)
