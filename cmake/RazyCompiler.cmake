# Flags of every razy target; IEEE semantics in all builds, so no -ffast-math.
add_library(razy_flags INTERFACE)
target_compile_options(razy_flags INTERFACE
  $<$<COMPILE_LANGUAGE:Fortran>:-std=f2018 -ffree-line-length-132 -fimplicit-none>
  $<$<COMPILE_LANGUAGE:Fortran>:-Wall -Wextra -Wimplicit-interface -Wimplicit-procedure -Wno-maybe-uninitialized -Wno-uninitialized -Wno-compare-reals>
  $<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<BOOL:${RAZY_WERROR}>>:-Werror>
  $<$<BOOL:${RAZY_NATIVE}>:-march=native>)

# Loops over modes are short and run-time sized, where vector prologues cost more than they save; measured in bench/.
set(CMAKE_Fortran_FLAGS_RELEASE "-O3 -fstack-arrays -fno-tree-vectorize")
include(CheckIPOSupported)
check_ipo_supported(RESULT razy_ipo LANGUAGES Fortran OUTPUT razy_ipo_reason)
if(razy_ipo)
  set(CMAKE_INTERPROCEDURAL_OPTIMIZATION_RELEASE ON)
  # Objects hold machine code too, so that the many test programs need not be optimised again when they are linked.
  set(CMAKE_Fortran_COMPILE_OPTIONS_IPO -flto=auto -ffat-lto-objects)
endif()
set(CMAKE_Fortran_FLAGS_DEBUG "-O1 -g -fcheck=all -fcheck=no-array-temps -fbacktrace -ffpe-trap=invalid,zero,overflow -finit-real=snan -finit-derived")
set(CMAKE_Fortran_FLAGS_COVERAGE "-O0 -g --coverage" CACHE STRING "Flags for coverage builds")
set(CMAKE_EXE_LINKER_FLAGS_COVERAGE "--coverage" CACHE STRING "Linker flags for coverage builds")
