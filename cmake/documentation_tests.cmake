# Tests that keep doc/ true.
ttsdf_unit_test(architecture/layers_test.cpp)
if(TARGET architecture_layers_test)
  target_compile_definitions(architecture_layers_test PRIVATE TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
endif()

if(PYTHON_EXECUTABLE)
  set(TTSDF_PYTHON "${PYTHON_EXECUTABLE}")
else()
  find_package(Python3 COMPONENTS Interpreter)
  set(TTSDF_PYTHON "${Python3_EXECUTABLE}")
endif()

ttsdf_unit_test(documentation/map_format_test.cpp LIBS ttsdf_core ZLIB::ZLIB)
if(TARGET documentation_map_format_test)
  target_compile_definitions(documentation_map_format_test PRIVATE
    TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}" TTSDF_PYTHON="${TTSDF_PYTHON}")
endif()

if(TTSDF_BUILD_ROS)
  ttsdf_unit_test(architecture/robot_libraries_test.cpp)
  if(TARGET architecture_robot_libraries_test)
    target_compile_definitions(architecture_robot_libraries_test PRIVATE
      TTSDF_LOCALIZATION_NODELET="$<TARGET_FILE:ttsdf_localization_nodelet>"
      TTSDF_LOCALIZATION_NODE="$<TARGET_FILE:localization_node>")
    add_dependencies(architecture_robot_libraries_test ttsdf_localization_nodelet localization_node)
  endif()
endif()
