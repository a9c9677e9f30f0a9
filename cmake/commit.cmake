# cmake -DGIT=git -DSOURCE=folder -DOUTPUT=commit.cpp -P commit.cmake
# Writes the commit that SOURCE is at, nothing where SOURCE is no repository; the file is touched only when that changes.
set(commit "")
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --show-cdup
    OUTPUT_VARIABLE up OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed AND up STREQUAL "")  # else a repository around unpacked sources: not ours
    execute_process(COMMAND ${GIT} -C ${SOURCE} describe --always --abbrev=7 --exclude=* --dirty
      OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
#include "cli/commit.h"

const char* const hextools::commit = "@commit@";
]])
