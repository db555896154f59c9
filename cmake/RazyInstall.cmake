include(CMakePackageConfigHelpers)
install(TARGETS razy EXPORT razyTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${CMAKE_Fortran_MODULE_DIRECTORY}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/razy FILES_MATCHING PATTERN "razy*.mod")
install(EXPORT razyTargets NAMESPACE razy:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/razy)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/razyConfig.cmake.in ${PROJECT_BINARY_DIR}/razyConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/razy)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/razyConfigVersion.cmake COMPATIBILITY SameMinorVersion)
# A consumer links machine code: optimising the library again at its link would take minutes.
if(razy_ipo AND CMAKE_OBJCOPY)
  install(CODE "execute_process(COMMAND ${CMAKE_OBJCOPY} -R .gnu.lto_* -R .gnu.debuglto_* -N __gnu_lto_v1
    \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/$<TARGET_FILE_NAME:razy>\")")
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/inputs DESTINATION ${CMAKE_INSTALL_DATADIR}/razy)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/post/src/razy ${PROJECT_SOURCE_DIR}/post/src/razy_post DESTINATION ${CMAKE_INSTALL_DATADIR}/razy/python FILES_MATCHING PATTERN "*.py")
foreach(entry "check razy.check.cli main" "csv razy.tools.cli csv_main" "doctor razy.tools.doctor main" "export razy.tools.cli export_main" "import-ross razy.tools.ross main" "merge razy.tools.cli merge_main" "plot razy.plot.cli main"
    "report razy.report.cli main" "view razy.view.cli main")
  string(REPLACE " " ";" entry ${entry})
  list(GET entry 0 program)
  list(GET entry 1 module)
  list(GET entry 2 function)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/program.py.in ${PROJECT_BINARY_DIR}/python/razy-${program} @ONLY)
  install(PROGRAMS ${PROJECT_BINARY_DIR}/python/razy-${program} DESTINATION ${CMAKE_INSTALL_BINDIR})
  list(APPEND razy_tools "\${there}/${CMAKE_INSTALL_BINDIR}/razy-${program}")
endforeach()
set(razy_paged "")
if(RAZY_PROGRAMS)
  foreach(program duel follow modes run sweep tune)
    list(APPEND razy_paged "\${there}/${CMAKE_INSTALL_BINDIR}/razy-${program}")
  endforeach()
endif()
set(razy_asked python3)
if(EXISTS "${RAZY_PYTHON}")
  set(razy_asked ${RAZY_PYTHON})
endif()
# Programs built for other machines than this one cannot say what they are for.
if(NOT CMAKE_CROSSCOMPILING)
  install(CODE "set(there \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\")
    execute_process(COMMAND ${CMAKE_COMMAND} -D \"FOLDER=\${there}/${CMAKE_INSTALL_MANDIR}/man1\" -D VERSION=${PROJECT_VERSION}
      -D PYTHON=${razy_asked} \"-DPROGRAMS=${razy_paged}\" \"-DTOOLS=${razy_tools}\" -P ${CMAKE_CURRENT_LIST_DIR}/man_pages.cmake)")
endif()
install(FILES ${PROJECT_BINARY_DIR}/razyConfig.cmake ${PROJECT_BINARY_DIR}/razyConfigVersion.cmake ${CMAKE_CURRENT_LIST_DIR}/RazyHDF5.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/razy)
