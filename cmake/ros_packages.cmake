# catkin, the messages, and where things go. Included before any target so that all of them land in the devel space.
find_package(catkin REQUIRED COMPONENTS
  message_generation roscpp nodelet pluginlib tf2 tf2_ros tf2_eigen tf2_geometry_msgs tf2_msgs
  std_msgs std_srvs geometry_msgs nav_msgs sensor_msgs diagnostic_msgs visualization_msgs
  diagnostic_updater message_filters dynamic_reconfigure)

add_message_files(DIRECTORY msg FILES
  TtSdfMap.msg
  AtlasMapInfo.msg
  AtlasInfo.msg
  AtlasMapFile.msg
  LocalizationStatus.msg
  MapReport.msg
  BuildProgress.msg)

add_service_files(DIRECTORY srv FILES
  GetMap.srv
  LoadMap.srv
  SetMap.srv
  Relocalize.srv
  GlobalLocalization.srv
  BuildMap.srv
  SaveMap.srv
  QueryDistances.srv
  GetDifferentialMap.srv
  GetSelectedMaps.srv)

generate_messages(DEPENDENCIES std_msgs geometry_msgs)

# What the headers of the two libraries include, others need, too.
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES ttsdf_ros ttsdf_core
  CATKIN_DEPENDS message_runtime roscpp nodelet tf2 tf2_ros std_msgs std_srvs geometry_msgs nav_msgs sensor_msgs
    diagnostic_msgs visualization_msgs diagnostic_updater message_filters dynamic_reconfigure
  DEPENDS EIGEN3)
