# HDF5, for razy and for those who use it. Its compiler wrapper splits the names of files at blanks, so it is asked in a folder
# without any.
set(razy_binary_dir ${CMAKE_CURRENT_BINARY_DIR})
if(razy_binary_dir MATCHES " ")
  execute_process(COMMAND mktemp -d OUTPUT_VARIABLE CMAKE_CURRENT_BINARY_DIR OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
find_package(HDF5 COMPONENTS Fortran HL)
if(razy_binary_dir MATCHES " ")
  file(REMOVE_RECURSE ${CMAKE_CURRENT_BINARY_DIR})
  set(CMAKE_CURRENT_BINARY_DIR ${razy_binary_dir})
endif()
