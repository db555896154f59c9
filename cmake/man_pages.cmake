# cmake -D FOLDER=… -D VERSION=… -D PYTHON=… -D PROGRAMS=a;b -D TOOLS=a;b -P man_pages.cmake: write FOLDER/<name>.1 for programs and for
# tools in Python (PYTHON may lack what these need: they have no page then), given as paths, from what each says to --help.
cmake_minimum_required(VERSION 3.25)
set(ENV{COLUMNS} 80)
set(ENV{OMPI_ALLOW_RUN_AS_ROOT} 1)
set(ENV{OMPI_ALLOW_RUN_AS_ROOT_CONFIRM} 1)
file(MAKE_DIRECTORY ${FOLDER})
string(TIMESTAMP day "%Y-%m-%d" UTC)

# A line of troff may not begin with . or '; a hyphen that is to be copied is \-.
function(as_troff text result)
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(REGEX REPLACE "(^|\n)([.'])" "\\1\\\\&\\2" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

# The part of `text` before the first place of `mark` and that behind it.
function(cut text mark before behind)
  string(FIND "${text}" "${mark}" place)
  string(LENGTH "${mark}" length)
  math(EXPR next "${place} + ${length}")
  string(SUBSTRING "${text}" 0 ${place} first)
  string(SUBSTRING "${text}" ${next} -1 rest)
  set(${before} "${first}" PARENT_SCOPE)
  set(${behind} "${rest}" PARENT_SCOPE)
endfunction()

foreach(program IN LISTS PROGRAMS TOOLS)
  get_filename_component(name ${program} NAME)
  set(words ${program})
  if(program IN_LIST TOOLS)
    set(words ${PYTHON} ${program})
  endif()
  execute_process(COMMAND ${words} --help OUTPUT_VARIABLE said RESULT_VARIABLE failed ERROR_QUIET)
  if(failed)
    message(STATUS "no manual page of ${name}: it does not run here")
    continue()
  endif()
  string(STRIP "${said}" said)
  if(program IN_LIST TOOLS)
    # usage: …, what it does, then arguments and options
    cut("${said}" "\n\n" usage rest)
    cut("${rest}" "\n\n" about rest)
    string(REGEX REPLACE "\n" " " about "${about}")
    string(REGEX REPLACE "[.:] .*|[.]$" "" summary "${about}")
  else()
    # name: what it does, then usage: … and options
    cut("${said}" "\n\n" about rest)
    cut("${about}" ": " unused about)
    cut("${rest}" "\n" usage rest)
    set(summary "${about}")
  endif()
  string(REGEX REPLACE "^usage: " "" usage "${usage}")
  string(REPLACE "\n       " "\n" usage "${usage}")
  foreach(part usage about summary rest)
    as_troff("${${part}}" ${part})
  endforeach()
  string(TOUPPER ${name} title)
  as_troff("${name}" shown)
  file(WRITE ${FOLDER}/${name}.1 ".TH ${title} 1 ${day} \"razy ${VERSION}\" \"razy\"
.SH NAME
${shown} \\- ${summary}
.SH SYNOPSIS
.nf
${usage}
.fi
.SH DESCRIPTION
${about}
.SH OPTIONS
.nf
${rest}
.fi
.SH SEE ALSO
Groups and keys of input files, methods and examples: the folder docs of razy.
")
endforeach()
