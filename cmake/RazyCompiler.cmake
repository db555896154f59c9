# Flags of every razy target; IEEE semantics in all builds, so nothing like -ffast-math, and no fused multiply-add unasked.
add_library(razy_flags INTERFACE)
set(fortran $<COMPILE_LANGUAGE:Fortran>)

if(CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  if(CMAKE_Fortran_COMPILER_VERSION VERSION_LESS 12)
    message(FATAL_ERROR "razy needs gfortran 12 or newer, found ${CMAKE_Fortran_COMPILER_VERSION}")
  endif()
  target_compile_options(razy_flags INTERFACE
    $<${fortran}:-std=f2018 -ffree-line-length-132 -fimplicit-none>
    $<${fortran}:-Wall -Wextra -Wimplicit-interface -Wimplicit-procedure -Wno-maybe-uninitialized -Wno-uninitialized -Wno-compare-reals>)
  # Loops over modes are short and of a length known at run time only, where vector prologues cost more than they save, and so do
  # calls of memcpy: vectors are made of blocks of known length (razy_linalg_blocks); measured in bench/.
  set(CMAKE_Fortran_FLAGS_RELEASE "-O3 -fopenmp-simd -fvect-cost-model=very-cheap -fno-tree-loop-distribute-patterns")
  set(CMAKE_Fortran_FLAGS_DEBUG "-O1 -g1 -fcheck=all -fcheck=no-array-temps -fbacktrace -ffpe-trap=invalid,zero,overflow -finit-real=snan -finit-derived")
elseif(CMAKE_Fortran_COMPILER_ID STREQUAL "LLVMFlang")
  # What flang calls a portability warning is standard Fortran; the rest of -pedantic would drown everything else.
  set(CMAKE_Fortran_FLAGS_RELEASE "-O2 -ffp-contract=off")
  set(CMAKE_Fortran_FLAGS_DEBUG "-O0 -g")
elseif(CMAKE_Fortran_COMPILER_ID MATCHES "Intel")
  target_compile_options(razy_flags INTERFACE $<${fortran}:-stand f18 -warn all>)
  set(CMAKE_Fortran_FLAGS_RELEASE "-O2 -fp-model=strict -assume protect_parens")
  set(CMAKE_Fortran_FLAGS_DEBUG "-O0 -g -traceback -check all -fp-model=strict")
elseif(CMAKE_Fortran_COMPILER_ID STREQUAL "NAG")
  target_compile_options(razy_flags INTERFACE $<${fortran}:-f2018 -ieee=full>)
  set(CMAKE_Fortran_FLAGS_RELEASE "-O3")
  set(CMAKE_Fortran_FLAGS_DEBUG "-g -C=all -gline")
else()
  message(WARNING "No flags are known for ${CMAKE_Fortran_COMPILER_ID}: those of CMake are used, which may not keep IEEE semantics")
endif()
target_compile_options(razy_flags INTERFACE
  $<$<AND:${fortran},$<BOOL:${RAZY_WERROR}>>:-Werror>
  $<$<BOOL:${RAZY_NATIVE}>:-march=native>)

include(CheckIPOSupported)
check_ipo_supported(RESULT razy_ipo LANGUAGES Fortran OUTPUT razy_ipo_reason)
if(razy_ipo AND CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  set(CMAKE_INTERPROCEDURAL_OPTIMIZATION_RELEASE ON)
  # Objects hold machine code too, so that the many test programs need not be optimised again when they are linked.
  set(CMAKE_Fortran_COMPILE_OPTIONS_IPO -flto=auto -ffat-lto-objects)
  # gfortran forgets the rules of Fortran for complex numbers at link time: each product would be looked at for NaN, as in C.
  set(CMAKE_Fortran_LINK_OPTIONS_IPO -fcx-fortran-rules)
endif()
# Of what another library or the compiler's own run-time library does, sanitizers see nothing.
set(razy_sanitizers "-O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined")
set(CMAKE_Fortran_FLAGS_SANITIZE "${razy_sanitizers}")
set(CMAKE_C_FLAGS_SANITIZE "${razy_sanitizers}")
set(CMAKE_Fortran_FLAGS_COVERAGE "-O0 -g --coverage")
set(CMAKE_EXE_LINKER_FLAGS_COVERAGE "--coverage")
