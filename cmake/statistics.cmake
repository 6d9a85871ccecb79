# Errors of poses and trajectories: what the demo and the evaluation share.
ttsdf_library(ttsdf_statistics
  SOURCES
    src/evaluation/statistics.cpp
    src/evaluation/trajectory_error.cpp
  PUBLIC ttsdf_core)

ttsdf_unit_test(evaluation/statistics_test.cpp LIBS ttsdf_statistics)
ttsdf_unit_test(evaluation/trajectory_error_test.cpp LIBS ttsdf_statistics)
