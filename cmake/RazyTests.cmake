# razy_add_test: a test program of .pf files, by pFUnit (4.14 or newer, with MPI for the tests that need it) where it is installed, by the
# stand-in in tests/support otherwise, or with CMAKE_DISABLE_FIND_PACKAGE_PFUNIT. razy_pfunit says which.
#
#   razy_add_test(name TEST_SOURCES a.pf… [OTHER_SOURCES …] [LINK_LIBRARIES …] [LABELS …] [MAX_PES n] [TIMEOUT seconds])
find_package(Python3 REQUIRED COMPONENTS Interpreter)
find_package(PFUNIT QUIET)

# More ranks than cores: the last is its name from Open MPI 5 on. Tests that call CMake take the build's generator.
set(RAZY_TEST_ENVIRONMENT OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
  PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe "CMAKE_GENERATOR=${CMAKE_GENERATOR}")

set(razy_pfunit OFF)
if(NOT PFUNIT_FOUND)
  set(razy_reason "not found")
elseif(NOT PFUNIT_VERSION VERSION_GREATER_EQUAL 4.14)
  set(razy_reason "${PFUNIT_VERSION} is older than 4.14")
elseif(RAZY_PROGRAMS AND NOT PFUNIT_MPI_FOUND)
  set(razy_reason "${PFUNIT_VERSION} was built without MPI")
else()
  set(razy_pfunit ON)
endif()
if(razy_pfunit)
  message(STATUS "Tests: pFUnit ${PFUNIT_VERSION}")
else()
  message(STATUS "Tests: pFUnit ${razy_reason}, its stand-in in tests/support is used")
  set(RAZY_PF_PREPROCESS ${PROJECT_SOURCE_DIR}/tests/support/pf_preprocess.py)

  # Translate .pf files and build the program `name` of them, with the flags of the project.
  function(razy_add_pf_executable name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "MAX_PES" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES")
    set(max_pes 0)
    set(framework razy_funit)
    if(arg_MAX_PES)
      set(max_pes ${arg_MAX_PES})
      set(framework razy_pfunit)
    endif()
    set(generated_dir ${CMAKE_CURRENT_BINARY_DIR}/${name}.dir)
    file(MAKE_DIRECTORY ${generated_dir})
    foreach(source IN LISTS arg_TEST_SOURCES)
      cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
      cmake_path(GET source STEM stem)
      set(generated ${generated_dir}/${stem}.f90)
      add_custom_command(OUTPUT ${generated}
        COMMAND Python3::Interpreter ${RAZY_PF_PREPROCESS} ${source} --max-pes ${max_pes} --output ${generated}
        DEPENDS ${source} ${RAZY_PF_PREPROCESS} VERBATIM COMMENT "Translating ${stem}.pf")
      list(APPEND sources ${source})
      list(APPEND modules ${generated})
    endforeach()
    set(driver ${generated_dir}/${name}_driver.f90)
    add_custom_command(OUTPUT ${driver}
      COMMAND Python3::Interpreter ${RAZY_PF_PREPROCESS} ${sources} --driver ${name} --max-pes ${max_pes} --output ${driver}
      DEPENDS ${RAZY_PF_PREPROCESS} VERBATIM COMMENT "Writing the driver of ${name}")
    add_executable(${name} ${modules} ${arg_OTHER_SOURCES} ${driver})
    set_target_properties(${name} PROPERTIES Fortran_MODULE_DIRECTORY ${generated_dir})
    target_include_directories(${name} PRIVATE ${generated_dir})
    target_link_libraries(${name} PRIVATE ${arg_LINK_LIBRARIES} ${framework} razy_flags)
    target_compile_options(${name} PRIVATE $<$<Fortran_COMPILER_ID:GNU>:-Wno-unused-dummy-argument>)
  endfunction()

  # The same arguments as pFUnit's own.
  function(add_pfunit_ctest name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "MAX_PES" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS")
    if(arg_UNPARSED_ARGUMENTS OR arg_KEYWORDS_MISSING_VALUES OR NOT arg_TEST_SOURCES)
      message(FATAL_ERROR "add_pfunit_ctest(${name}): not understood: '${arg_UNPARSED_ARGUMENTS}', "
        "without value: '${arg_KEYWORDS_MISSING_VALUES}', TEST_SOURCES: '${arg_TEST_SOURCES}'")
    endif()
    if(NOT arg_MAX_PES)
      set(arg_MAX_PES 0)
    endif()
    razy_add_pf_executable(${name} MAX_PES ${arg_MAX_PES} TEST_SOURCES ${arg_TEST_SOURCES}
      OTHER_SOURCES ${arg_OTHER_SOURCES} LINK_LIBRARIES ${arg_LINK_LIBRARIES})
    set(command $<TARGET_FILE:${name}>)
    if(arg_MAX_PES)
      set(command ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG} ${arg_MAX_PES} ${MPIEXEC_PREFLAGS} ${command})
    endif()
    add_test(NAME ${name} COMMAND ${command} WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
    set_tests_properties(${name} PROPERTIES
      FAIL_REGULAR_EXPRESSION "Encountered 1 or more failures/errors during testing" LABELS "${arg_LABELS}")
  endfunction()
endif()

function(razy_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "MAX_PES;TIMEOUT" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS")
  if(arg_UNPARSED_ARGUMENTS OR arg_KEYWORDS_MISSING_VALUES)
    message(FATAL_ERROR "razy_add_test(${name}): not understood: '${arg_UNPARSED_ARGUMENTS}', "
      "without value: '${arg_KEYWORDS_MISSING_VALUES}'")
  endif()
  set(arguments TEST_SOURCES ${arg_TEST_SOURCES})
  foreach(key OTHER_SOURCES LINK_LIBRARIES MAX_PES)
    if(arg_${key})
      list(APPEND arguments ${key} ${arg_${key}})
    endif()
  endforeach()
  # pFUnit starts an MPI program from this folder.
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  add_pfunit_ctest(${name} ${arguments})
  set(processors 1)
  if(arg_MAX_PES)
    set(processors ${arg_MAX_PES})
  endif()
  set(timeout 60)
  if(arg_TIMEOUT)
    set(timeout ${arg_TIMEOUT})
  endif()
  # With a pass expression CTest ignores the exit code, so what a crash prints must fail.
  set_tests_properties(${name} PROPERTIES
    LABELS "${arg_LABELS}" ENVIRONMENT "${RAZY_TEST_ENVIRONMENT}" PROCESSORS ${processors} TIMEOUT ${timeout}
    PASS_REGULAR_EXPRESSION "(^|\n) OK\n"
    FAIL_REGULAR_EXPRESSION "Encountered 1 or more failures/errors during testing;ERROR STOP;Fortran runtime error;Program received signal;mpirun detected;mpirun noticed;mpiexec noticed;mpiexec detected;MPI_ABORT was invoked")
endfunction()
