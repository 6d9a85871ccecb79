# Tests that keep doc/ true.
ttsdf_unit_test(architecture/layers_test.cpp)
if(TARGET architecture_layers_test)
  target_compile_definitions(architecture_layers_test PRIVATE TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
endif()

ttsdf_unit_test(architecture/core_symbols_test.cpp)
if(TARGET architecture_core_symbols_test)
  target_compile_definitions(architecture_core_symbols_test PRIVATE TTSDF_NM="${CMAKE_NM}"
    TTSDF_CORE_LIBRARY="$<TARGET_FILE:ttsdf_core>" TTSDF_COMPRESSION_LIBRARY="$<TARGET_FILE:ttsdf_compression>")
  add_dependencies(architecture_core_symbols_test ttsdf_core ttsdf_compression)
endif()

if(PYTHON_EXECUTABLE)
  set(TTSDF_PYTHON "${PYTHON_EXECUTABLE}")
else()
  find_program(TTSDF_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)  # the one that has Debian's numpy
  find_program(TTSDF_PYTHON python3)
endif()

ttsdf_unit_test(documentation/map_format_test.cpp LIBS ttsdf_compression ZLIB::ZLIB)
if(TARGET documentation_map_format_test)
  target_compile_definitions(documentation_map_format_test PRIVATE
    TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}" TTSDF_PYTHON="${TTSDF_PYTHON}")
endif()

if(TTSDF_BUILD_TESTS AND TTSDF_BUILD_SIMULATION AND TTSDF_BUILD_EVALUATION)
  # The figures of doc/results and README are of today's code, and the commands of the pages for beginners work.
  add_test(NAME results_current_test COMMAND "${TTSDF_PYTHON}" -B "${CMAKE_CURRENT_SOURCE_DIR}/test/documentation/results_current_test.py")
  add_test(NAME documentation_commands_test COMMAND "${TTSDF_PYTHON}" -B
    "${CMAKE_CURRENT_SOURCE_DIR}/test/documentation/commands_test.py" "$<TARGET_FILE_DIR:ttsdf_build>")
  set_tests_properties(documentation_commands_test PROPERTIES TIMEOUT 600)
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

# Pages of the whole package.
if(TTSDF_BUILD_ROS AND TTSDF_BUILD_SIMULATION AND TTSDF_BUILD_EVALUATION)
  ttsdf_unit_test(documentation/parameters_page_test.cpp
    LIBS ttsdf_map_builder ttsdf_simulation_ros ttsdf_demo ttsdf_operator ttsdf_map_surface ttsdf_evaluation ttsdf_comparison)
  if(TARGET documentation_parameters_page_test)
    target_compile_definitions(documentation_parameters_page_test PRIVATE
      TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
  endif()
  if(TTSDF_BUILD_TESTS AND CATKIN_ENABLE_TESTING)
    set(TTSDF_PAGE_TESTS "${CMAKE_CURRENT_SOURCE_DIR}/test/documentation")
    add_test(NAME documentation_interface_page_test
      COMMAND "${TTSDF_PYTHON}" -B "${TTSDF_PAGE_TESTS}/interface_page_test.py")
    add_test(NAME documentation_pages_test COMMAND "${TTSDF_PYTHON}" -B "${TTSDF_PAGE_TESTS}/pages_test.py")
    add_test(NAME documentation_tools_page_test
      COMMAND "${TTSDF_PYTHON}" -B "${TTSDF_PAGE_TESTS}/tools_page_test.py" "$<TARGET_FILE_DIR:ttsdf_build>")
  endif()
endif()
