# SPDX-License-Identifier: Apache-2.0
# Libraries compile the sources of a room together, up to eight in a translation unit: what costs is reading the headers of
# Eigen, ITK, VTK and JSON, not our lines. clang-tidy, and whoever works on one source again and again, wants each apart.
option(HEXTOOLS_UNITY "Compile sources of a room together" ON)

# compile_together(target count): that many sources of a target in a translation unit, in their order.
function(compile_together target count)
  get_target_property(sources ${target} SOURCES)
  list(LENGTH sources num_sources)
  if(HEXTOOLS_UNITY AND num_sources GREATER 1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${count})
  endif()
endfunction()

# compile_by_rooms(target [SINGLE room...]): those of the rooms named stay apart.
function(compile_by_rooms target)
  cmake_parse_arguments(ARG "" "" "SINGLE" ${ARGN})
  if(NOT HEXTOOLS_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  foreach(source ${sources})
    get_filename_component(folder "${source}" DIRECTORY)
    get_filename_component(room "${folder}" NAME)
    if(room IN_LIST ARG_SINGLE)
      continue()
    endif()
    if(NOT DEFINED count_of_${room})
      set(count_of_${room} 0)
    endif()
    math(EXPR number "${count_of_${room}} / 8")
    math(EXPR count_of_${room} "${count_of_${room}} + 1")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${room}_${number}")
  endforeach()
endfunction()
