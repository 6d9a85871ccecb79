# Debian packages (scripts/package): ttsdf-localization for the robot, ttsdf-localization-tools with the builder and the tools.
# What catkin installs by itself (messages, package.xml) has no component: it goes to the robot, too.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ttsdf-localization)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The ttsdf_localization authors <maintainers@users.noreply.h-seed-8c5ef348.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CATKIN_DEVEL_PREFIX}/lib")

set(CPACK_DEBIAN_ROBOT_PACKAGE_NAME ttsdf-localization)
set(CPACK_DEBIAN_ROBOT_DESCRIPTION "localization of depth cameras in compressed signed distance maps
 Nodelet and node (ROS 1) that register scans in a map compressed with the tensor-train decomposition, a map server, and an
 operator's menu.")
set(CPACK_DEBIAN_ROBOT_PACKAGE_DEPENDS "python3-roslaunch, libnodeletlib-tools, python3-rosservice, python3-genpy")
set(CPACK_DEBIAN_ROBOT_PACKAGE_RECOMMENDS "libdepth-image-proc-dev")
set(CPACK_DEBIAN_ROBOT_PACKAGE_SUGGESTS "rviz")
set(CPACK_DEBIAN_ROBOT_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/cmake/debian/prerm")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME ttsdf-localization-tools)
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "builder and tools of ttsdf-localization
 Builds compressed maps from depth frames, clouds, meshes and volumes, by nodelet or command line; looks at, samples, converts and
 compares them; localizes in bags; simulates a depth camera.")
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS
  "ttsdf-localization (= ${PROJECT_VERSION}), python3-rosbag, python3-rospy, \
python3-geometry-msgs, python3-sensor-msgs, python3-tf2-msgs, python3-numpy, python3-pil")
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "rviz, python3-matplotlib")
set(CPACK_DEBIAN_TOOLS_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/cmake/debian/prerm")

include(CPack)
cpack_add_component(Unspecified GROUP robot)
cpack_add_component(robot GROUP robot)
cpack_add_component(tools GROUP tools)
cpack_add_component_group(robot)
cpack_add_component_group(tools)
