# Layer 3: conversions, the node classes, nodelets and nodes. One section per part; the localization part links the core
# only, so that neither OpenVDB nor VTK gets into the robot's process.

# ---- functions -------------------------------------------------------------------------------------------------------
if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)  # not through catkin: that would replace catkin_LIBRARIES
endif()

# ttsdf_ros_library(<name> SOURCES ... LIBS ...): a library on top of roscpp and this package's messages.
function(ttsdf_ros_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  ttsdf_library(${name} SOURCES ${ARG_SOURCES} PUBLIC ${ARG_LIBS} ${catkin_LIBRARIES}
    INCLUDE ${CATKIN_DEVEL_PREFIX}/include ${catkin_INCLUDE_DIRS})
  # Headers of the nodes stand beside their sources and are not installed.
  target_include_directories(${name} PUBLIC "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/src>")
  add_dependencies(${name} ${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS})
endfunction()

# ttsdf_node(<name> SOURCES ... LIBS ...): an executable that roslaunch finds.
function(ttsdf_node name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  ttsdf_tool(${name} SOURCES ${ARG_SOURCES} LIBS ${ARG_LIBS})
endfunction()

# ttsdf_rostest(<behaviour.test> [SOURCE file.cpp] [LIBS ...] [DEPENDS targets ...] [ARGS name:=value ...]):
# test/ros/<behaviour>.test, with its gtest program if it has one. A Python test gives DEPENDS only.
function(ttsdf_rostest launch)
  if(NOT TTSDF_BUILD_TESTS OR NOT CATKIN_ENABLE_TESTING)
    return()
  endif()
  cmake_parse_arguments(ARG "" "SOURCE" "LIBS;DEPENDS;ARGS" ${ARGN})
  if(ARG_SOURCE)
    string(REPLACE ".cpp" "" target "ros_${ARG_SOURCE}")
    if(NOT TARGET ${target})
      ttsdf_ros_test_program(${target} ${ARG_SOURCE} ${ARG_LIBS})
    endif()
    list(APPEND ARG_DEPENDS ${target})
  endif()
  add_rostest(test/ros/${launch} ARGS ${ARG_ARGS} DEPENDENCIES ${ARG_DEPENDS})
endfunction()

# A program in test/ros, built with the tests and found by roslaunch.
function(ttsdf_ros_test_program target source)
  if(NOT TTSDF_BUILD_TESTS OR NOT CATKIN_ENABLE_TESTING)
    return()
  endif()
  add_executable(${target} EXCLUDE_FROM_ALL test/ros/${source})
  target_link_libraries(${target} ${ARGN} GTest::gtest ttsdf_warnings)
  add_dependencies(tests ${target})
endfunction()

# ---- messages, headers, what is no target ----------------------------------------------------------------------------
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION} COMPONENT tools)
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(DIRECTORY launch config rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(PROGRAMS scripts/atlas_dask scripts/frames_from scripts/frames_to_bag scripts/frames_to_batch
  scripts/evaluate_trajectory scripts/plot_map
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(FILES scripts/poses.py scripts/depth_frames.py scripts/trajectory_files.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

find_package(PNG REQUIRED)

# ---- localization (core + ros) ---------------------------------------------------------------------------------------
ttsdf_ros_library(ttsdf_ros
  SOURCES
    src/ros/messages/conversions.cpp
    src/ros/messages/cloud_conversion.cpp
    src/ros/messages/compressed_depth.cpp
    src/ros/messages/depth_conversion.cpp
    src/ros/messages/stamps.cpp
    src/ros/parameters/parameters.cpp
    src/ros/parameters/localization_options.cpp
    src/ros/scans/clock_watch.cpp
    src/ros/poses/pose_input.cpp
    src/ros/poses/pose_saver.cpp
    src/ros/poses/pose_store.cpp
    src/ros/scans/gravity_hint.cpp
    src/ros/maps/map_source.cpp
    src/ros/maps/atlas_client.cpp
    src/ros/maps/atlas_messages.cpp
    src/ros/maps/atlas_source.cpp
    src/ros/maps/folder_watch.cpp
    src/ros/scans/scan_queue.cpp
    src/ros/scans/scan_localizer.cpp
    src/ros/scans/transform_buffer.cpp
    src/ros/node/live_parameters.cpp
    src/ros/node/global_worker.cpp
    src/ros/node/tf_output.cpp
    src/ros/node/scan_input.cpp
    src/ros/node/localization_output.cpp
    src/ros/node/localization_diagnostics.cpp
    src/ros/node/localization_pipeline.cpp
    src/ros/node/localization_pipeline_events.cpp
    src/ros/node/localization_pipeline_global.cpp
    src/ros/node/localization_ros.cpp
    src/ros/node/localization_ros_services.cpp
  LIBS ttsdf_core ttsdf_atlas PNG::PNG)
ttsdf_ros_library(ttsdf_localization_nodelet SOURCES src/nodes/localization_nodelet.cpp LIBS ttsdf_ros)
ttsdf_node(localization_node SOURCES src/nodes/localization_node.cpp LIBS ttsdf_ros)

ttsdf_unit_test(ros/messages/cloud_conversion_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/messages/conversions_test.cpp LIBS ttsdf_ros ttsdf_compression)
ttsdf_unit_test(ros/scans/clock_watch_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/messages/stamps_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/maps/folder_watch_test.cpp LIBS ttsdf_ros ttsdf_atlas)
ttsdf_unit_test(ros/poses/pose_store_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/parameters/parameters_test.cpp LIBS ttsdf_ros yaml-cpp)
if(TARGET ros_parameters_test)
  target_compile_definitions(ros_parameters_test PRIVATE TTSDF_CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")
endif()

# Tests with real nodes localize in a map of an analytic room, made when the tests are built.
ttsdf_ros_test_program(make_room_map make_room_map.cpp ttsdf_compression)
if(TARGET make_room_map)
  set(TTSDF_TEST_MAPS "${CMAKE_CURRENT_BINARY_DIR}/test_maps")
  add_custom_command(OUTPUT "${TTSDF_TEST_MAPS}/room.ttsdf" "${TTSDF_TEST_MAPS}/room_rank_25.ttsdf"
    COMMAND ${CMAKE_COMMAND} -E make_directory "${TTSDF_TEST_MAPS}/hall" "${TTSDF_TEST_MAPS}/twins"
      "${TTSDF_TEST_MAPS}/alike"
    COMMAND make_room_map "${TTSDF_TEST_MAPS}/room.ttsdf" 40
    COMMAND make_room_map "${TTSDF_TEST_MAPS}/room_rank_25.ttsdf" 25
    COMMAND make_room_map "${TTSDF_TEST_MAPS}/hall/hall.ttsdf" 40 0.05 hall
    COMMAND make_room_map "${TTSDF_TEST_MAPS}/hall/room.ttsdf" 40 0.05 room 30
    COMMAND ${CMAKE_COMMAND} -E copy "${TTSDF_TEST_MAPS}/room.ttsdf" "${TTSDF_TEST_MAPS}/twins/room.ttsdf"
    COMMAND make_room_map "${TTSDF_TEST_MAPS}/twins/twin.ttsdf" 40 0.05 room 30
    COMMAND ${CMAKE_COMMAND} -E copy "${TTSDF_TEST_MAPS}/room.ttsdf" "${TTSDF_TEST_MAPS}/alike/room.ttsdf"
    COMMAND make_room_map "${TTSDF_TEST_MAPS}/alike/other.ttsdf" 40 0.05 other 30
    DEPENDS make_room_map VERBATIM)
  add_custom_target(test_maps DEPENDS "${TTSDF_TEST_MAPS}/room.ttsdf" "${TTSDF_TEST_MAPS}/room_rank_25.ttsdf")
  # Both maps as an atlas, in Autoware's form.
  file(WRITE "${TTSDF_TEST_MAPS}/atlas.yaml"
    "x_resolution: 10\ny_resolution: 10\nroom.ttsdf: [0, 0]\nroom_rank_25.ttsdf: [0, 0]\n")
  # The room behind a hall, the room with a twin, and with one that differs in one piece of furniture.
  file(WRITE "${TTSDF_TEST_MAPS}/hall/atlas.yaml"
    "x_resolution: 10\ny_resolution: 10\nhall.ttsdf: [0, 0]\nroom.ttsdf: [30, 0]\n")
  file(WRITE "${TTSDF_TEST_MAPS}/twins/atlas.yaml"
    "x_resolution: 10\ny_resolution: 10\nroom.ttsdf: [0, 0]\ntwin.ttsdf: [30, 0]\n")
  file(WRITE "${TTSDF_TEST_MAPS}/alike/atlas.yaml"
    "x_resolution: 10\ny_resolution: 10\nroom.ttsdf: [0, 0]\nother.ttsdf: [30, 0]\n")
  add_dependencies(tests test_maps)
endif()
# Every behaviour is asked of the nodelet; the node is a twin of few lines, and is asked one.
foreach(behaviour
    localization no_odometry external_prior tf_output missing_transforms bad_clouds map_change initialpose time_jump lost
    quiet traps map_sources start_pose atlas atlas_global)
  ttsdf_rostest(${behaviour}.test DEPENDS test_maps ttsdf_localization_nodelet
    ARGS map_dir:=${TTSDF_TEST_MAPS} nodelet:=true)
endforeach()
ttsdf_rostest(localization.test DEPENDS test_maps localization_node ARGS map_dir:=${TTSDF_TEST_MAPS} nodelet:=false)
ttsdf_rostest(faults.test DEPENDS test_maps ttsdf_localization_nodelet ARGS map_dir:=${TTSDF_TEST_MAPS})
# Debian 11's description of depth_image_proc names a library that is not there: launch/depth_to_cloud.launch needs it.
set(TTSDF_DEPTH_TO_CLOUD ON)
find_file(TTSDF_DEPTH_IMAGE_PROC_PLUGINS depth_image_proc/nodelet_plugins.xml PATH_SUFFIXES share PATHS /usr/share)
mark_as_advanced(TTSDF_DEPTH_IMAGE_PROC_PLUGINS)
if(TTSDF_DEPTH_IMAGE_PROC_PLUGINS)
  file(READ "${TTSDF_DEPTH_IMAGE_PROC_PLUGINS}" plugins)
  get_filename_component(prefix "${TTSDF_DEPTH_IMAGE_PROC_PLUGINS}" DIRECTORY)
  if(plugins MATCHES "path=\"lib/" AND NOT EXISTS "${prefix}/../../lib/libdepth_image_proc.so")
    set(TTSDF_DEPTH_TO_CLOUD OFF)
    message(STATUS "rostests of depth images made into clouds: skipped, this system's depth_image_proc cannot be loaded")
  endif()
endif()
set(examples)
if(TTSDF_DEPTH_TO_CLOUD)
  set(examples robot_example handheld_example)
endif()
foreach(behaviour two_robots bad_parameters start_stop ${examples})
  ttsdf_rostest(${behaviour}.test DEPENDS test_maps localization_node ttsdf_localization_nodelet
    ARGS map_dir:=${TTSDF_TEST_MAPS})
endforeach()

ttsdf_unit_test(ros/scans/newest_slot_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/scans/scan_queue_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/messages/depth_conversion_test.cpp LIBS ttsdf_ros)
ttsdf_unit_test(ros/node/live_parameters_test.cpp LIBS ttsdf_ros)
ttsdf_rostest(live_parameters.test SOURCE live_parameters_node_test.cpp LIBS ttsdf_ros
  DEPENDS test_maps ttsdf_localization_nodelet ARGS map_dir:=${TTSDF_TEST_MAPS})

# ---- map server ------------------------------------------------------------------------------------------------------
ttsdf_ros_library(ttsdf_map_server
  SOURCES
    src/ros/server/atlas_server_ros.cpp
    src/ros/server/map_publisher.cpp
    src/ros/server/map_server_ros.cpp
    src/ros/server/planner_output.cpp
  LIBS ttsdf_ros ttsdf_atlas ttsdf_occupancy)
ttsdf_node(map_server_node SOURCES src/nodes/map_server_node.cpp LIBS ttsdf_map_server)

ttsdf_rostest(map_server.test SOURCE map_server_test.cpp LIBS ttsdf_ros ttsdf_compression DEPENDS map_server_node)
if(TARGET ros_map_server_test)
  target_compile_definitions(ros_map_server_test PRIVATE MAP_SERVER_NODE="$<TARGET_FILE:map_server_node>")
endif()

foreach(behaviour atlas_server atlas_server_killed)
  ttsdf_rostest(${behaviour}.test DEPENDS test_maps ttsdf_localization_nodelet map_server_node
    ARGS map_dir:=${TTSDF_TEST_MAPS} nodelet:=true)
endforeach()

# ---- operator's menu in rviz -------------------------------------------------------------------------------------------
find_package(interactive_markers REQUIRED)
ttsdf_ros_library(ttsdf_operator SOURCES src/ros/operator/operator_menu.cpp LIBS ttsdf_ros ${interactive_markers_LIBRARIES})
ttsdf_node(operator_menu_node SOURCES src/nodes/operator_menu_node.cpp LIBS ttsdf_operator)
ttsdf_rostest(operator_menu.test DEPENDS test_maps ttsdf_localization_nodelet operator_menu_node
  ARGS map_dir:=${TTSDF_TEST_MAPS})

# ---- tests of the whole package ------------------------------------------------------------------------------------------
if(TTSDF_BUILD_TESTS AND CATKIN_ENABLE_TESTING)
  add_test(NAME documentation_behaviour_page_test COMMAND ${PYTHON_EXECUTABLE} -B
    "${CMAKE_CURRENT_SOURCE_DIR}/test/documentation/behaviour_page_test.py")
  add_test(NAME launch_files_test COMMAND ${PYTHON_EXECUTABLE} -B
    "${CMAKE_CURRENT_SOURCE_DIR}/test/ros/launch_files_test.py")
  add_test(NAME package_exports_test COMMAND ${CMAKE_CTEST_COMMAND}
    --build-and-test "${CMAKE_CURRENT_SOURCE_DIR}/test/package" "${CMAKE_CURRENT_BINARY_DIR}/package_exports"
    --build-generator ${CMAKE_GENERATOR} --build-options "-DCMAKE_PREFIX_PATH=${CATKIN_DEVEL_PREFIX}"
    -DPYTHON_EXECUTABLE=${PYTHON_EXECUTABLE} -DPython3_EXECUTABLE=${PYTHON_EXECUTABLE}
    --test-command uses_ttsdf_localization)
  find_program(TTSDF_CATKIN_LINT catkin_lint)
  mark_as_advanced(TTSDF_CATKIN_LINT)
  if(TTSDF_CATKIN_LINT)
    add_test(NAME catkin_lint_test COMMAND ${TTSDF_CATKIN_LINT} --offline --strict "${CMAKE_CURRENT_SOURCE_DIR}")
  endif()
  add_test(NAME scripts_test COMMAND ${PYTHON_EXECUTABLE} "${CMAKE_CURRENT_SOURCE_DIR}/test/scripts/scripts_test.py")
endif()
