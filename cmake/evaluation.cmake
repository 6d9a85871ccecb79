# Evaluation: pose and trajectory errors, the paper's perturbation sweep, point cloud baselines. PCL; no ROS.
find_package(PCL REQUIRED COMPONENTS common)
# By name and not through PCL's imported targets: those of io bring the whole of VTK into every link line.
set(TTSDF_PCL_LIBRARIES)
foreach(name common io kdtree search features filters registration)
  find_library(TTSDF_PCL_${name}_LIBRARY pcl_${name} REQUIRED)
  mark_as_advanced(TTSDF_PCL_${name}_LIBRARY)
  list(APPEND TTSDF_PCL_LIBRARIES ${TTSDF_PCL_${name}_LIBRARY})
endforeach()

ttsdf_library(ttsdf_evaluation
  SOURCES
    src/evaluation/cloud_methods.cpp
    src/evaluation/fast_global_registration.cpp
    src/evaluation/feature_methods.cpp
    src/evaluation/field_methods.cpp
    src/evaluation/map_memory.cpp
    src/evaluation/method_factory.cpp
    src/evaluation/perturbation.cpp
    src/evaluation/scan_set.cpp
    src/evaluation/statistics.cpp
    src/evaluation/sweep.cpp
    src/evaluation/sweep_log.cpp
    src/evaluation/sweep_summary.cpp
    src/evaluation/synthetic_frames.cpp
    src/evaluation/trajectory_error.cpp
  PUBLIC ttsdf_core ttsdf_mapping
  PRIVATE ${TTSDF_PCL_LIBRARIES}
  INCLUDE ${PCL_INCLUDE_DIRS})
# GCC 12 reads vector loads of Eigen, instantiated from PCL's templates, as out of bounds.
set_source_files_properties(src/evaluation/cloud_methods.cpp src/evaluation/feature_methods.cpp PROPERTIES
  COMPILE_OPTIONS -Wno-array-bounds)

ttsdf_unit_test(evaluation/statistics_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/perturbation_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/sweep_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/trajectory_error_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/fast_global_registration_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/cloud_methods_test.cpp LIBS ttsdf_evaluation)
ttsdf_unit_test(evaluation/synthetic_frames_test.cpp LIBS ttsdf_evaluation ttsdf_simulation)

# The script around it: its parts, and a whole run on simulated data. Debian's Python, whatever comes first in PATH.
if(TTSDF_BUILD_TESTS)
  foreach(name evaluation_page registration_report evaluate_quick)
    add_test(NAME ${name}_test COMMAND /usr/bin/python3 "${CMAKE_CURRENT_SOURCE_DIR}/test/evaluation/${name}_test.py")
    set_tests_properties(${name}_test PROPERTIES ENVIRONMENT "TTSDF_BUILD_DIR=${CMAKE_BINARY_DIR}" TIMEOUT 600)
  endforeach()
endif()
