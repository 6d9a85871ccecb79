# The command-line programs and what they share.
find_package(Boost REQUIRED COMPONENTS program_options)
find_package(yaml-cpp REQUIRED)
if(NOT TARGET JsonCpp::JsonCpp)  # VTK's packages define it too
  find_package(jsoncpp REQUIRED)
endif()

ttsdf_library(ttsdf_tools
  SOURCES
    src/tools/command_line.cpp
    src/tools/json_file.cpp
    src/tools/map_edit.cpp
    src/tools/progress.cpp
    src/tools/scan_io.cpp
    src/tools/spectra.cpp
  PUBLIC ttsdf_core ttsdf_compression JsonCpp::JsonCpp
  PRIVATE Boost::program_options ${YAML_CPP_LIBRARIES} ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY}
  INCLUDE ${PCL_INCLUDE_DIRS})

ttsdf_tool(ttsdf_build SOURCES src/tools/ttsdf_build.cpp LIBS ttsdf_tools ttsdf_mapping)
ttsdf_tool(ttsdf_info SOURCES src/tools/ttsdf_info.cpp LIBS ttsdf_tools)
target_compile_definitions(ttsdf_info PRIVATE TTSDF_SCRIPTS_DIR="${CMAKE_CURRENT_SOURCE_DIR}/scripts")
ttsdf_tool(ttsdf_query SOURCES src/tools/ttsdf_query.cpp LIBS ttsdf_tools)
ttsdf_tool(ttsdf_register SOURCES src/tools/ttsdf_register.cpp LIBS ttsdf_tools ttsdf_evaluation)
ttsdf_tool(ttsdf_convert SOURCES src/tools/ttsdf_convert.cpp LIBS ttsdf_tools ttsdf_mapping)
ttsdf_tool(ttsdf_evaluate SOURCES src/tools/ttsdf_evaluate.cpp LIBS ttsdf_tools ttsdf_evaluation)
ttsdf_tool(ttsdf_simulate SOURCES src/tools/ttsdf_simulate.cpp LIBS ttsdf_tools ttsdf_evaluation ttsdf_simulation)

ttsdf_unit_test(tools/command_line_test.cpp LIBS ttsdf_tools)
ttsdf_unit_test(tools/map_edit_test.cpp LIBS ttsdf_tools)
ttsdf_unit_test(tools/scan_io_test.cpp LIBS ttsdf_tools ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY})
ttsdf_unit_test(tools/spectra_test.cpp LIBS ttsdf_tools)

# Tests that run the programs themselves.
function(ttsdf_tool_test source)
  ttsdf_unit_test(${source} ${ARGN})
  string(REPLACE "/" "_" target "${source}")
  string(REPLACE ".cpp" "" target "${target}")
  if(TARGET ${target})
    target_compile_definitions(${target} PRIVATE TTSDF_TOOL_DIR="$<TARGET_FILE_DIR:ttsdf_build>")
    add_dependencies(${target}
      ttsdf_build ttsdf_info ttsdf_query ttsdf_register ttsdf_convert ttsdf_evaluate)
  endif()
endfunction()

ttsdf_tool_test(tools/map_tools_test.cpp LIBS ttsdf_tools)
ttsdf_tool_test(tools/register_tool_test.cpp LIBS ttsdf_tools ttsdf_mapping)
ttsdf_tool_test(tools/build_tool_test.cpp
  LIBS ttsdf_tools ttsdf_mapping ttsdf_simulation ${TTSDF_PCL_common_LIBRARY} ${TTSDF_PCL_io_LIBRARY})
