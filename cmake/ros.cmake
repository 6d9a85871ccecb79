# Layer 3: conversions, the node classes, nodelets and nodes. One section per part; the localization part links the core
# only, so that neither OpenVDB nor VTK gets into the robot's process.

# ---- functions -------------------------------------------------------------------------------------------------------
find_package(catkin REQUIRED COMPONENTS rostest)
find_package(Eigen3 REQUIRED)

# ttsdf_ros_library(<name> SOURCES ... LIBS ...): a library on top of roscpp and this package's messages.
function(ttsdf_ros_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  ttsdf_library(${name} SOURCES ${ARG_SOURCES} PUBLIC ${ARG_LIBS} ${catkin_LIBRARIES}
    INCLUDE ${CATKIN_DEVEL_PREFIX}/include ${catkin_INCLUDE_DIRS})
  add_dependencies(${name} ${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS})
endfunction()

# ttsdf_node(<name> SOURCES ... LIBS ...): an executable that roslaunch finds.
function(ttsdf_node name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  ttsdf_tool(${name} SOURCES ${ARG_SOURCES} LIBS ${ARG_LIBS})
endfunction()

# ttsdf_rostest(<behaviour.test> [SOURCE file.cpp] [LIBS ...] [DEPENDS targets ...]): test/ros/<behaviour>.test, with its gtest
# program if it has one. A Python test gives DEPENDS only.
function(ttsdf_rostest launch)
  if(NOT TTSDF_BUILD_TESTS OR NOT CATKIN_ENABLE_TESTING)
    return()
  endif()
  cmake_parse_arguments(ARG "" "SOURCE" "LIBS;DEPENDS" ${ARGN})
  if(ARG_SOURCE)
    string(REPLACE ".cpp" "" target "ros_${ARG_SOURCE}")
    if(NOT TARGET ${target})
      ttsdf_ros_test_program(${target} ${ARG_SOURCE} ${ARG_LIBS})
    endif()
    list(APPEND ARG_DEPENDS ${target})
  endif()
  add_rostest(test/ros/${launch} DEPENDENCIES ${ARG_DEPENDS})
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
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(DIRECTORY launch config DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})

# ---- localization (core + ros) ---------------------------------------------------------------------------------------

# ---- map building and map server -------------------------------------------------------------------------------------

# ---- simulation and demo ---------------------------------------------------------------------------------------------
