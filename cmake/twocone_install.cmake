# SPDX-License-Identifier: Apache-2.0
# There are two components. `program` holds the files that a robot needs and that are in the Debian package. `development`
# is for find_package(twocone) in other projects: the public interface (include/twocone), its shared libraries and
# their files for pkg-config.
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
write_basic_package_version_file(${PROJECT_BINARY_DIR}/twoconeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/twoconeConfig.cmake ${PROJECT_BINARY_DIR}/twoconeConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone COMPONENT development)

# The folders are as in the source tree, so that robots/lab_sim.yaml finds ../scenes/lab.map.yaml.
install(DIRECTORY robots scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/twocone COMPONENT program)
install(FILES cmake/deb/70-twocone.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES README.md ARCHITECTURE.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program
        PATTERN evidence EXCLUDE PATTERN twocone.1 EXCLUDE PATTERN *.sh EXCLUDE PATTERN *.pov EXCLUDE PATTERN *.inc EXCLUDE)

# Debian requires these files compressed. This happens at configure time, because an install must not need a build.
set(TWOCONE_MAINTAINER "twocone <twocone@localhost>" CACHE STRING "Maintainer of the Debian package: NAME <ADDRESS>")
configure_file(cmake/deb/changelog.in ${PROJECT_BINARY_DIR}/changelog @ONLY)
find_program(GZIP gzip REQUIRED)
function(twocone_install_compressed source destination)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
  get_filename_component(name ${source} NAME)
  execute_process(COMMAND ${GZIP} -9nc ${source} OUTPUT_FILE ${PROJECT_BINARY_DIR}/${name}.gz COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.gz DESTINATION ${destination} COMPONENT program)
endfunction()
twocone_install_compressed(${PROJECT_SOURCE_DIR}/docs/twocone.1 ${CMAKE_INSTALL_MANDIR}/man1)
twocone_install_compressed(${PROJECT_BINARY_DIR}/changelog ${CMAKE_INSTALL_DOCDIR})
install(FILES cmake/deb/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES cmake/deb/lintian-overrides RENAME twocone DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides COMPONENT program)

include(twocone_deb)
