find_package(catkin REQUIRED COMPONENTS
  message_generation roscpp nodelet pluginlib tf2 tf2_ros tf2_eigen tf2_geometry_msgs
  std_msgs std_srvs geometry_msgs nav_msgs sensor_msgs diagnostic_msgs visualization_msgs
  diagnostic_updater message_filters)
