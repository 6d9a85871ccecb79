# The simulated world: analytic scenes, a depth camera, drifting odometry. Needs the core only.
# Square roots of non-negative numbers only: without errno they become vector instructions. Vectors never cross a call.
set_source_files_properties(src/simulation/depth_renderer.cpp PROPERTIES
  COMPILE_OPTIONS "-O3;-fno-math-errno;-fno-trapping-math;-Wno-psabi")
ttsdf_library(ttsdf_simulation
  SOURCES
    src/simulation/scenes/solid.cpp
    src/simulation/scenes/analytic_scene.cpp
    src/simulation/scenes/scene_sampling.cpp
    src/simulation/scenes/scene_builder.cpp
    src/simulation/scenes/furniture.cpp
    src/simulation/scenes/apartment.cpp
    src/simulation/scenes/building.cpp
    src/simulation/scenes/hotel.cpp
    src/simulation/scenes/worlds.cpp
    src/simulation/depth_noise.cpp
    src/simulation/pose_noise.cpp
    src/simulation/depth_renderer.cpp
    src/simulation/depth_camera.cpp
    src/simulation/mesh_renderer.cpp
    src/simulation/trajectory.cpp
    src/simulation/drifting_odometry.cpp
    src/simulation/moving_clutter.cpp
    src/simulation/simulated_rig.cpp
  PUBLIC ttsdf_core Eigen3::Eigen
  PRIVATE Threads::Threads)

ttsdf_unit_test(simulation/solid_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/analytic_scene_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/hotel_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/worlds_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/depth_camera_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/mesh_renderer_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/trajectory_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/drifting_odometry_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/pose_noise_test.cpp LIBS ttsdf_simulation)
ttsdf_unit_test(simulation/simulated_rig_test.cpp LIBS ttsdf_simulation)
