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
    src/mapping/depth_image.cpp
    src/mapping/depth_image_io.cpp
    src/mapping/frame_folder.cpp
    src/mapping/pinhole.cpp
    src/mapping/surface_pixels.cpp
    src/mapping/depth_pyramid.cpp
    src/mapping/view_blocks.cpp
    src/mapping/surface_guard.cpp
    src/mapping/block_update.cpp
    src/mapping/depth_fusion.cpp
    src/mapping/cloud_fusion.cpp
    src/mapping/tsdf_volume.cpp
    src/mapping/vdb_import.cpp
    src/mapping/vdb_io.cpp
    src/mapping/ideal_volume.cpp
    # volume or mesh -> signed field
    src/mapping/observed_grid.cpp
    src/mapping/observed_volume.cpp
    src/mapping/observed_sides.cpp
    src/mapping/observed_surface.cpp
    src/mapping/surface_extraction.cpp
    src/mapping/sharp_edges.cpp
    src/mapping/subdivided.cpp
    src/mapping/nearest_surface.cpp
    src/mapping/manhattan_frame.cpp
    src/mapping/signed_distance.cpp
    src/mapping/hole_filling.cpp
    src/mapping/smooth_unknown.cpp
    src/mapping/field_grid.cpp
    src/mapping/field_bricks.cpp
    src/mapping/sampled_field.cpp
    src/mapping/surface_survey.cpp
    src/mapping/sampled_field_surface.cpp
    src/mapping/sampled_field_tiles.cpp
    src/mapping/sampled_field_baselines.cpp
    src/mapping/mesh_io.cpp
    src/mapping/mesh_sides.cpp
    src/mapping/mesh_sampling.cpp
    # signed field -> compressed map
    src/mapping/build_options.cpp
    src/mapping/build_report.cpp
    src/mapping/field_slabs.cpp
    src/mapping/compression.cpp
  PUBLIC ttsdf_core
  PRIVATE OpenVDB::openvdb TBB::tbb assimp::assimp ${VIGRAIMPEX_LIBRARY}
  INCLUDE ${VIGRA_INCLUDE_DIR})

# depth in
set(TTSDF_VDB_TEST_LIBS ttsdf_mapping OpenVDB::openvdb TBB::tbb)
ttsdf_unit_test(mapping/frame_folder_test.cpp LIBS ttsdf_mapping ${VIGRAIMPEX_LIBRARY})
ttsdf_unit_test(mapping/pinhole_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/depth_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(mapping/block_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(mapping/carving_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(mapping/cloud_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(mapping/vdb_io_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(mapping/real_frames_test.cpp LIBS ttsdf_mapping)

# signed field
ttsdf_unit_test(mapping/observed_surface_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/nearest_surface_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/observed_sides_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/manhattan_frame_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/sampled_field_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/field_bricks_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/sampled_tiles_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(mapping/mesh_sampling_test.cpp LIBS ttsdf_mapping)
