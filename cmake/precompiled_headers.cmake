# SPDX-License-Identifier: Apache-2.0
# Most sources read the same large headers, which takes longer than our lines do. clang-tidy, and a check of whether each
# source names what it uses, want them read again.
option(HEXTOOLS_PRECOMPILE "Precompile the headers that most sources read" ON)

set(HEXTOOLS_LARGE_HEADERS
  <Eigen/Dense> <algorithm> <array> <cmath> <filesystem> <functional> <map> <memory> <optional> <random> <set> <string> <vector>)

# precompiled(owner LINK ... HEADERS ...): an owner of precompiled headers, apart since a library's definitions are not those of
# another.
function(precompiled owner)
  cmake_parse_arguments(ARG "" "" "LINK;HEADERS" ${ARGN})
  add_library(${owner} OBJECT ${PROJECT_SOURCE_DIR}/cmake/no_code.cpp)
  target_link_libraries(${owner} PRIVATE Eigen3::Eigen OpenMP::OpenMP_CXX hextools_flags ${ARG_LINK})
  target_compile_definitions(${owner} PRIVATE EIGEN_DONT_PARALLELIZE)
  target_precompile_headers(${owner} PRIVATE ${HEXTOOLS_LARGE_HEADERS} ${ARG_HEADERS})
endfunction()

# precompile_from(owner target...): targets with OpenMP that read the owner's headers precompiled.
function(precompile_from owner)
  if(TARGET ${owner})
    foreach(target ${ARGN})
      target_precompile_headers(${target} REUSE_FROM ${owner})
    endforeach()
  endif()
endfunction()

if(HEXTOOLS_PRECOMPILE)
  precompiled(library_headers LINK fmt::fmt HEADERS <fmt/format.h>)
endif()
