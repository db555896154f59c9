# The commit is read when CMake configures; a source archive without git says "unknown".
find_package(Git QUIET)
set(RAZY_GIT_COMMIT "unknown")
if(GIT_FOUND)
  execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty --abbrev=12
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE razy_git_output
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE razy_git_result)
  if(razy_git_result EQUAL 0)
    set(RAZY_GIT_COMMIT "${razy_git_output}")
  endif()
endif()
configure_file(${PROJECT_SOURCE_DIR}/src/core/version.f90.in ${PROJECT_BINARY_DIR}/generated/version.f90 @ONLY)
