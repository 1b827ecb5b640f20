# Writes version.h at every build; touches it only when something changed.  cmake -D SOURCE=.. -D OUT=.. -D VERSION=.. -D BUILD=.. -P version.cmake
cmake_minimum_required(VERSION 3.22)
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 OUTPUT_VARIABLE git OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(git "unknown")
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT "/* made by cmake/version.cmake */\n#define CLEAVE_VERSION \"@VERSION@\"\n#define CLEAVE_GIT \"@git@\"\n#define CLEAVE_BUILD \"@BUILD@\"\n" @ONLY)
