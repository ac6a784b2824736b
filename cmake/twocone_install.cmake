# SPDX-License-Identifier: Apache-2.0
# find_package(twocone) for other projects: the library targets, their headers, and what they depend on.
install(EXPORT twoconeTargets NAMESPACE twocone:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone)
configure_package_config_file(cmake/twoconeConfig.cmake.in ${PROJECT_BINARY_DIR}/twoconeConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/twoconeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/twoconeConfig.cmake ${PROJECT_BINARY_DIR}/twoconeConfigVersion.cmake
              cmake/FindODE.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/twocone)
# As in the source tree, so that robots/lab_sim.yaml finds ../scenes/lab.map.yaml.
install(DIRECTORY robots scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/twocone)
