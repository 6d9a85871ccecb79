# The command-line programs and what they share.

# By name and not through PCL's package file: it looks for the whole of VTK, and its io brings it into every link line.
find_path(TTSDF_PCL_INCLUDE_DIR pcl/point_types.h
  PATH_SUFFIXES pcl-1.16 pcl-1.15 pcl-1.14 pcl-1.13 pcl-1.12 pcl-1.11 pcl-1.10)
mark_as_advanced(TTSDF_PCL_INCLUDE_DIR)
if(NOT TTSDF_PCL_INCLUDE_DIR)
  message(FATAL_ERROR "PCL's headers are not installed; scripts/packages.txt names the packages (scripts/setup)")
endif()
set(TTSDF_PCL_LIBRARIES)
macro(ttsdf_find_pcl name)
  ttsdf_find_library(TTSDF_PCL_${name}_LIBRARY pcl_${name})
  list(APPEND TTSDF_PCL_LIBRARIES ${TTSDF_PCL_${name}_LIBRARY})
endmacro()
ttsdf_find_pcl(common)
ttsdf_find_pcl(io)

find_package(Boost REQUIRED COMPONENTS program_options)

ttsdf_library(ttsdf_tools
  SOURCES
    src/tools/common/command_line.cpp
    src/tools/common/json_file.cpp
    src/tools/map_edit.cpp
    src/tools/map_memory.cpp
    src/tools/common/option_file.cpp
    src/tools/common/printable.cpp
    src/tools/common/progress.cpp
    src/tools/common/scan_io.cpp
    src/tools/spectra.cpp
  PUBLIC ttsdf_core ttsdf_compression ttsdf_readers JsonCpp::JsonCpp
  PRIVATE Boost::program_options ttsdf_yaml)

ttsdf_tool(ttsdf_build
  SOURCES src/tools/ttsdf_build.cpp src/tools/build_sources.cpp src/tools/source_flags.cpp src/tools/source_frames.cpp
  LIBS ttsdf_tools ttsdf_mapping ttsdf_exports)
ttsdf_tool(ttsdf_export SOURCES src/tools/ttsdf_export.cpp LIBS ttsdf_tools ttsdf_exports)
ttsdf_tool(ttsdf_info SOURCES src/tools/ttsdf_info.cpp LIBS ttsdf_tools)
target_compile_definitions(ttsdf_info PRIVATE TTSDF_SCRIPTS_DIR="${CMAKE_CURRENT_SOURCE_DIR}/scripts")
ttsdf_tool(ttsdf_query SOURCES src/tools/ttsdf_query.cpp LIBS ttsdf_tools)
ttsdf_tool(ttsdf_convert SOURCES src/tools/ttsdf_convert.cpp LIBS ttsdf_tools ttsdf_mapping)
# The program ttsdf_atlas; the library has the target of this name.
ttsdf_tool(ttsdf_atlas_tool
  SOURCES
    src/tools/atlas/ttsdf_atlas.cpp
    src/tools/atlas/atlas_build.cpp
    src/tools/atlas/atlas_edit.cpp
    src/tools/atlas/atlas_index.cpp
    src/tools/atlas/atlas_mesh.cpp
    src/tools/atlas/atlas_show.cpp
    src/tools/atlas/atlas_tasks.cpp
    src/tools/atlas/atlas_update.cpp
    src/tools/atlas/atlas_versions.cpp
    src/tools/atlas/atlas_workers.cpp
    src/tools/atlas/map_change.cpp
    src/tools/build_sources.cpp
    src/tools/source_flags.cpp
    src/tools/source_frames.cpp
  LIBS ttsdf_tools ttsdf_atlas ttsdf_mapping ttsdf_exports)
set_target_properties(ttsdf_atlas_tool PROPERTIES OUTPUT_NAME ttsdf_atlas)
target_compile_definitions(ttsdf_atlas_tool PRIVATE TTSDF_SCRIPTS_DIR="${CMAKE_CURRENT_SOURCE_DIR}/scripts")

ttsdf_unit_test(tools/command_line_test.cpp LIBS ttsdf_tools)
ttsdf_unit_test(tools/map_edit_test.cpp LIBS ttsdf_tools)
ttsdf_unit_test(tools/scan_io_test.cpp LIBS ttsdf_tools ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY}
  INCLUDE ${TTSDF_PCL_INCLUDE_DIR})
ttsdf_unit_test(tools/spectra_test.cpp LIBS ttsdf_tools)

# Tests that run the programs themselves.
function(ttsdf_tool_test source)
  ttsdf_unit_test(${source} ${ARGN})
  string(REPLACE "/" "_" target "${source}")
  string(REPLACE ".cpp" "" target "${target}")
  if(TARGET ${target})
    target_compile_definitions(${target} PRIVATE TTSDF_TOOL_DIR="$<TARGET_FILE_DIR:ttsdf_build>")
    add_dependencies(${target} ttsdf_atlas_tool ttsdf_build ttsdf_export ttsdf_info ttsdf_query ttsdf_convert)
    if(TTSDF_BUILD_EVALUATION)
      add_dependencies(${target} ttsdf_register ttsdf_evaluate)
    endif()
  endif()
endfunction()

ttsdf_tool_test(tools/map_tools_test.cpp LIBS ttsdf_tools)
if(TTSDF_BUILD_SIMULATION)
  ttsdf_tool_test(tools/build_tool_test.cpp
    LIBS ttsdf_tools ttsdf_mapping ttsdf_simulation ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY}
    INCLUDE ${TTSDF_PCL_INCLUDE_DIR})
endif()
if(TTSDF_BUILD_SIMULATION)
  foreach(test atlas_build_test atlas_tool_test atlas_update_test)
    ttsdf_tool_test(tools/${test}.cpp LIBS ttsdf_tools ttsdf_atlas ttsdf_mapping ttsdf_simulation
      ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY} INCLUDE ${TTSDF_PCL_INCLUDE_DIR})
  endforeach()
endif()
ttsdf_unit_test(tools/mutated_files_test.cpp LIBS ttsdf_tools ttsdf_mapping OpenVDB::openvdb ${TTSDF_TBB_LIBRARY})
ttsdf_tool_test(exports/export_tool_test.cpp LIBS ttsdf_tools ttsdf_exports OpenVDB::openvdb ${TTSDF_TBB_LIBRARY}
  ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY} INCLUDE ${TTSDF_PCL_INCLUDE_DIR})
ttsdf_tool_test(exports/octrees_test.cpp
  LIBS ttsdf_tools ttsdf_exports ${TTSDF_OCTOMAP_LIBRARY} ${TTSDF_OCTOMATH_LIBRARY})
