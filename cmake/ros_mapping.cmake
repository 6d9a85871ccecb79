# Layer 3, what needs map building or the tools: the map builder, its pictures in rviz, bags without a master.

# ---- map building ------------------------------------------------------------------------------------------------------
ttsdf_ros_library(ttsdf_map_visualization SOURCES src/ros/operator/map_visualization.cpp LIBS ttsdf_ros ttsdf_mapping)

ttsdf_ros_library(ttsdf_map_builder
  SOURCES
    src/ros/builder/fusion_checkpoint.cpp
    src/ros/builder/map_build_request.cpp
    src/ros/builder/map_builder_options.cpp
    src/ros/builder/map_builder_ros.cpp
    src/ros/builder/map_views.cpp
    src/ros/builder/posed_cloud_source.cpp
    src/ros/builder/scan_fuser.cpp
    src/ros/builder/silence_warning.cpp
    src/ros/scans/scan_selector.cpp
  LIBS ttsdf_map_server ttsdf_map_visualization)
ttsdf_ros_library(ttsdf_map_builder_nodelet SOURCES src/nodes/map_builder_nodelet.cpp LIBS ttsdf_map_builder)
ttsdf_node(map_builder_node SOURCES src/nodes/map_builder_node.cpp LIBS ttsdf_map_builder)

ttsdf_unit_test(ros/scans/scan_selector_test.cpp LIBS ttsdf_map_builder)
ttsdf_unit_test(ros/builder/map_build_request_test.cpp LIBS ttsdf_map_builder)
ttsdf_unit_test(ros/operator/map_visualization_test.cpp LIBS ttsdf_map_visualization)
ttsdf_unit_test(ros/builder/map_builder_config_test.cpp LIBS ttsdf_map_builder yaml-cpp)
if(TARGET ros_map_builder_config_test)
  target_compile_definitions(ros_map_builder_config_test PRIVATE TTSDF_CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")
endif()
if(TTSDF_DEPTH_TO_CLOUD)
  ttsdf_rostest(bag_replay.test DEPENDS ttsdf_map_builder_nodelet ttsdf_localization_nodelet)
endif()

# ---- a bag without a master ------------------------------------------------------------------------------------------
find_package(rosbag_storage REQUIRED)
ttsdf_library(ttsdf_offline
  SOURCES
    src/ros/offline/bag_localizer.cpp
    src/ros/offline/bag_player.cpp
    src/ros/offline/offline_report.cpp
    src/ros/offline/offline_run.cpp
    src/ros/parameters/yaml_parameters.cpp
  PUBLIC ttsdf_ros ${rosbag_storage_LIBRARIES}
  PRIVATE ttsdf_tools ttsdf_yaml ${YAML_CPP_LIBRARIES}
  INCLUDE ${rosbag_storage_INCLUDE_DIRS})
ttsdf_node(offline_localizer SOURCES src/nodes/offline_localizer.cpp LIBS ttsdf_offline ttsdf_tools)
ttsdf_rostest(live_offline.test DEPENDS test_maps ttsdf_localization_nodelet offline_localizer
  ARGS map_dir:=${TTSDF_TEST_MAPS})

# ---- map surface in rviz -----------------------------------------------------------------------------------------------
ttsdf_ros_library(ttsdf_map_surface SOURCES src/ros/operator/map_surface.cpp LIBS ttsdf_map_visualization)
ttsdf_node(map_surface_node SOURCES src/nodes/map_surface_node.cpp LIBS ttsdf_map_surface)
ttsdf_rostest(map_surface.test DEPENDS test_maps ttsdf_localization_nodelet map_surface_node
  ARGS map_dir:=${TTSDF_TEST_MAPS})

# ---- filters of clouds (launch/filter_cloud.launch) ----------------------------------------------------------------------
find_path(TTSDF_PCL_ROS_INCLUDE_DIR pcl_ros/filters/filter.h)
find_library(TTSDF_PCL_ROS_FILTER_LIBRARY NAMES pcl_ros_filter pcl_ros_filters)  # Debian's name, ROS's
mark_as_advanced(TTSDF_PCL_ROS_INCLUDE_DIR TTSDF_PCL_ROS_FILTER_LIBRARY)
if(TTSDF_PCL_ROS_INCLUDE_DIR AND TTSDF_PCL_ROS_FILTER_LIBRARY)
  ttsdf_find_pcl(filters)
  ttsdf_ros_library(ttsdf_cloud_filter_nodelet SOURCES src/nodes/cloud_filter_nodelet.cpp
    LIBS ttsdf_ros ${TTSDF_PCL_ROS_FILTER_LIBRARY} ${TTSDF_PCL_filters_LIBRARY} ${TTSDF_PCL_common_LIBRARY})
  target_include_directories(ttsdf_cloud_filter_nodelet PRIVATE ${TTSDF_PCL_ROS_INCLUDE_DIR} ${TTSDF_PCL_INCLUDE_DIR})
endif()
