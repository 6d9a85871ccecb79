# Layer 2: fusion of depth into OpenVDB volumes, signed fields from volumes and meshes, map building. No ROS.

# OpenVDB ships its find module beside the library, not where CMake looks for it.
find_path(TTSDF_OPENVDB_MODULE_DIR FindOpenVDB.cmake
  PATH_SUFFIXES lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB lib/cmake/OpenVDB lib64/cmake/OpenVDB
  DOC "Folder of FindOpenVDB.cmake")
mark_as_advanced(TTSDF_OPENVDB_MODULE_DIR)
# TBB's own package first: OpenVDB's find module would define one of its targets and leave PCL's search half done.
find_package(TBB CONFIG REQUIRED)
list(APPEND CMAKE_MODULE_PATH "${TTSDF_OPENVDB_MODULE_DIR}")
find_package(OpenVDB REQUIRED COMPONENTS openvdb)
list(REMOVE_ITEM CMAKE_MODULE_PATH "${TTSDF_OPENVDB_MODULE_DIR}")
find_package(assimp REQUIRED)
find_library(VIGRAIMPEX_LIBRARY vigraimpex REQUIRED)
find_path(VIGRA_INCLUDE_DIR vigra/impex.hxx REQUIRED)

ttsdf_library(ttsdf_mapping
  SOURCES
    # depth in: images, folders, clouds -> volume
    src/frames/depth_image.cpp
    src/frames/depth_image_io.cpp
    src/frames/frame_folder.cpp
    src/frames/pinhole.cpp
    src/fusion/surface_pixels.cpp
    src/fusion/depth_pyramid.cpp
    src/fusion/view_blocks.cpp
    src/fusion/surface_guard.cpp
    src/fusion/block_update.cpp
    src/fusion/depth_fusion.cpp
    src/fusion/cloud_fusion.cpp
    src/fusion/tsdf_volume.cpp
    src/fusion/vdb_import.cpp
    src/fusion/vdb_io.cpp
    src/signed_field/ideal_volume.cpp
    # volume or mesh -> signed field
    src/surface/observed_grid.cpp
    src/signed_field/observed_volume.cpp
    src/surface/observed_sides.cpp
    src/surface/observed_surface.cpp
    src/signed_field/surface_extraction.cpp
    src/surface/sharp_edges.cpp
    src/surface/subdivided.cpp
    src/surface/nearest_surface.cpp
    src/surface/manhattan_frame.cpp
    src/signed_field/signed_distance.cpp
    src/signed_field/hole_filling.cpp
    src/signed_field/smooth_unknown.cpp
    src/signed_field/field_grid.cpp
    src/signed_field/field_bricks.cpp
    src/signed_field/sampled_field.cpp
    src/signed_field/surface_survey.cpp
    src/signed_field/sampled_field_surface.cpp
    src/signed_field/sampled_field_tiles.cpp
    src/signed_field/sampled_field_baselines.cpp
    src/mesh/mesh_io.cpp
    src/mesh/mesh_sides.cpp
    src/mesh/mesh_sampling.cpp
    # signed field -> compressed map
    src/build_steps/build_options.cpp
    src/mapping/build_report.cpp
    src/mapping/field_slabs.cpp
    src/mapping/compression.cpp
  PUBLIC ttsdf_core ttsdf_compression
  PRIVATE OpenVDB::openvdb TBB::tbb assimp::assimp ${VIGRAIMPEX_LIBRARY}
  INCLUDE ${VIGRA_INCLUDE_DIR})

# depth in
set(TTSDF_VDB_TEST_LIBS ttsdf_mapping OpenVDB::openvdb TBB::tbb)
ttsdf_unit_test(frames/frame_folder_test.cpp LIBS ttsdf_mapping ${VIGRAIMPEX_LIBRARY})
ttsdf_unit_test(frames/pinhole_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(fusion/depth_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/block_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/carving_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/cloud_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/vdb_io_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(frames/real_frames_test.cpp LIBS ttsdf_mapping)

# signed field
ttsdf_unit_test(surface/observed_surface_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(surface/nearest_surface_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(surface/observed_sides_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(surface/manhattan_frame_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(signed_field/sampled_field_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(signed_field/field_bricks_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(signed_field/sampled_tiles_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mesh/mesh_sampling_test.cpp LIBS ttsdf_mapping)

# all of it
ttsdf_unit_test(mapping/compression_test.cpp LIBS ttsdf_mapping)
