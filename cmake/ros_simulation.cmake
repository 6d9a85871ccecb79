# Layer 3, what needs the simulated world: the simulated camera, the demo, tests that drive it.

# ---- simulation and demo ---------------------------------------------------------------------------------------------
ttsdf_ros_library(ttsdf_simulation_ros
  SOURCES
    src/ros/demo/depth_messages.cpp
    src/ros/demo/simulated_camera_options.cpp
    src/ros/demo/simulated_camera_ros.cpp
  LIBS ttsdf_simulation ttsdf_ros)
ttsdf_node(simulated_camera_node SOURCES src/nodes/simulated_camera_node.cpp LIBS ttsdf_simulation_ros)

ttsdf_unit_test(ros/demo/depth_messages_test.cpp LIBS ttsdf_simulation_ros)
ttsdf_unit_test(ros/demo/simulated_camera_options_test.cpp LIBS ttsdf_simulation_ros ${YAML_CPP_LIBRARIES})
if(TARGET ros_simulated_camera_options_test)
  target_compile_definitions(ros_simulated_camera_options_test PRIVATE
    TTSDF_CONFIG_FOLDER="${CMAKE_CURRENT_SOURCE_DIR}/config")
endif()
ttsdf_rostest(simulated_camera.test SOURCE simulated_camera_test.cpp LIBS ttsdf_simulation_ros
  DEPENDS simulated_camera_node)

ttsdf_ros_library(ttsdf_demo
  SOURCES
    src/ros/demo/demo_report.cpp
    src/ros/demo/demo_ros.cpp
  LIBS ttsdf_ros ttsdf_statistics)
ttsdf_node(demo_node SOURCES src/nodes/demo_node.cpp LIBS ttsdf_demo)

ttsdf_unit_test(ros/demo/demo_report_test.cpp LIBS ttsdf_demo)

# What scripts/demo runs, and the tools that a user turns to next.
if(TTSDF_BUILD_MAPPING)
  add_custom_target(demo)
  add_dependencies(demo
    demo_node simulated_camera_node operator_menu_node map_surface_node
    ttsdf_localization_nodelet ttsdf_map_builder_nodelet
    ttsdf_build ttsdf_info ${PROJECT_NAME}_generate_messages_py)
endif()

# ---- tests of other parts on simulated scans -----------------------------------------------------------------------------
# Faults at random for as long as one likes: scripts/reliability.
ttsdf_ros_test_program(fault_run faults/fault_run.cpp ttsdf_ros ttsdf_simulation)
ttsdf_rostest(reliability.test DEPENDS test_maps fault_run ARGS map_dir:=${TTSDF_TEST_MAPS})
if(TTSDF_BUILD_MAPPING)
  ttsdf_rostest(map_builder.test SOURCE map_builder_test.cpp LIBS ttsdf_ros ttsdf_mapping ttsdf_simulation
    DEPENDS map_builder_node)
  ttsdf_rostest(map_builder_nodelet.test DEPENDS ros_map_builder_test ttsdf_map_builder_nodelet)
  ttsdf_unit_test(ros/offline/offline_localizer_test.cpp LIBS ttsdf_ros ttsdf_simulation ${rosbag_storage_LIBRARIES})
  if(TARGET ros_offline_localizer_test)
    target_compile_definitions(ros_offline_localizer_test PRIVATE
      TTSDF_TOOL_DIR="$<TARGET_FILE_DIR:offline_localizer>" TTSDF_TEST_MAPS="${TTSDF_TEST_MAPS}")
    add_dependencies(ros_offline_localizer_test offline_localizer test_maps)
    add_test(NAME ros_odd_bags_test COMMAND /usr/bin/python3 -B "${CMAKE_CURRENT_SOURCE_DIR}/test/ros/offline/odd_bags_test.py"
      $<TARGET_FILE:offline_localizer> "${TTSDF_TEST_MAPS}/room.ttsdf")
  endif()
endif()
