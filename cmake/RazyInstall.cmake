include(CMakePackageConfigHelpers)
install(TARGETS razy EXPORT razyTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${CMAKE_Fortran_MODULE_DIRECTORY}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/razy FILES_MATCHING PATTERN "razy*.mod")
install(EXPORT razyTargets NAMESPACE razy:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/razy)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/razyConfig.cmake.in ${PROJECT_BINARY_DIR}/razyConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/razy)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/razyConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/razyConfig.cmake ${PROJECT_BINARY_DIR}/razyConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/razy)
