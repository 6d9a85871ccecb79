# Evaluation: pose and trajectory errors, the paper's perturbation sweep, point cloud baselines. PCL; no ROS.
foreach(name kdtree search features filters registration)
  ttsdf_find_pcl(${name})
endforeach()

ttsdf_library(ttsdf_evaluation
  SOURCES
    src/evaluation/field_methods.cpp
    src/evaluation/method_memory.cpp
    src/evaluation/paper_method.cpp
    src/evaluation/perturbation.cpp
    src/evaluation/scan_set.cpp
    src/evaluation/sweep.cpp
    src/evaluation/sweep_log.cpp
    src/evaluation/sweep_summary.cpp
    src/evaluation/synthetic_frames.cpp
  PUBLIC ttsdf_statistics ttsdf_mapping
  PRIVATE ${TTSDF_PCL_LIBRARIES}
  INCLUDE ${TTSDF_PCL_INCLUDE_DIR})

# The methods of others, and Open3D's where it is installed (the paper compares with those): only what compares links it.
find_package(Open3D CONFIG QUIET)
if(Open3D_FOUND)
  set(TTSDF_OPEN3D_SOURCE src/evaluation/open3d_methods.cpp)
  set(TTSDF_OPEN3D_LIBRARIES Open3D::Open3D)
else()
  set(TTSDF_OPEN3D_SOURCE src/evaluation/open3d_absent.cpp)
  set(TTSDF_OPEN3D_LIBRARIES)
endif()
# GCC 12 reads vector loads of Eigen, instantiated from the templates of PCL and Open3D, as out of bounds.
set_source_files_properties(src/evaluation/cloud_methods.cpp ${TTSDF_OPEN3D_SOURCE} PROPERTIES
  COMPILE_OPTIONS -Wno-array-bounds)
ttsdf_library(ttsdf_comparison
  SOURCES
    src/evaluation/cloud_methods.cpp
    src/evaluation/method_factory.cpp
    ${TTSDF_OPEN3D_SOURCE}
  PUBLIC ttsdf_evaluation
  PRIVATE ${TTSDF_PCL_LIBRARIES} ${TTSDF_OPEN3D_LIBRARIES})

ttsdf_tool(ttsdf_register SOURCES src/tools/ttsdf_register.cpp LIBS ttsdf_tools ttsdf_evaluation)
ttsdf_tool(ttsdf_evaluate SOURCES src/tools/ttsdf_evaluate.cpp LIBS ttsdf_tools ttsdf_comparison)
ttsdf_tool_test(tools/register_tool_test.cpp LIBS ttsdf_tools ttsdf_mapping)
ttsdf_tool_test(tools/register_formats_test.cpp LIBS ttsdf_tools ttsdf_mapping)
ttsdf_tool_test(documentation/troubleshooting_test.cpp LIBS ttsdf_tools)
if(TARGET documentation_troubleshooting_test)
  target_compile_definitions(documentation_troubleshooting_test PRIVATE TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
endif()

ttsdf_unit_test(evaluation/perturbation_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/sweep_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/paper_method_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/cloud_methods_test.cpp LIBS ttsdf_comparison INCLUDE ${TTSDF_PCL_INCLUDE_DIR})
if(TTSDF_BUILD_SIMULATION)
  ttsdf_unit_test(evaluation/synthetic_frames_test.cpp LIBS ttsdf_evaluation ttsdf_simulation)
  ttsdf_tool(ttsdf_simulate SOURCES src/tools/ttsdf_simulate.cpp LIBS ttsdf_tools ttsdf_evaluation ttsdf_simulation)
endif()

ttsdf_unit_test(pcl/map_registration_test.cpp LIBS ttsdf_compression ${TTSDF_PCL_LIBRARIES} INCLUDE ${TTSDF_PCL_INCLUDE_DIR})

# The script around it: its parts, and a whole run on simulated data. Debian's Python, whatever comes first in PATH.
if(TTSDF_BUILD_TESTS)
  foreach(name results evaluate_quick)
    add_test(NAME ${name}_test COMMAND /usr/bin/python3 "${CMAKE_CURRENT_SOURCE_DIR}/test/evaluation/${name}_test.py")
    set_tests_properties(${name}_test PROPERTIES ENVIRONMENT "TTSDF_BUILD_DIR=${CMAKE_BINARY_DIR}" TIMEOUT 600)
  endforeach()
endif()
