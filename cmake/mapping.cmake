# Layer 2: fusion of depth into OpenVDB volumes, signed fields from volumes and meshes, map building. No ROS.

# By name: TBB's, OpenVDB's and assimp's package files differ between releases, are absent, or name missing folders.
ttsdf_find_library(TTSDF_TBB_LIBRARY tbb)
ttsdf_find_library(TTSDF_ASSIMP_LIBRARY assimp)
ttsdf_find_library(TTSDF_OPENVDB_LIBRARY openvdb)
find_library(TTSDF_HALF_LIBRARY Half)  # of OpenEXR 2, which OpenVDB 7 takes its half floats from
mark_as_advanced(TTSDF_HALF_LIBRARY)
add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
find_library(TTSDF_IMATH_LIBRARY NAMES Imath Imath-3_1)  # of OpenEXR 3
mark_as_advanced(TTSDF_IMATH_LIBRARY)
set_target_properties(OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION "${TTSDF_OPENVDB_LIBRARY}"
  INTERFACE_LINK_LIBRARIES "${TTSDF_TBB_LIBRARY};$<$<BOOL:${TTSDF_HALF_LIBRARY}>:${TTSDF_HALF_LIBRARY}>;$<$<BOOL:${TTSDF_IMATH_LIBRARY}>:${TTSDF_IMATH_LIBRARY}>")
ttsdf_find_library(VIGRAIMPEX_LIBRARY vigraimpex)
find_path(VIGRA_INCLUDE_DIR vigra/impex.hxx)

if(NOT TARGET JsonCpp::JsonCpp)  # VTK's packages define it too, jsoncpp's own since 1.9.5
  find_package(jsoncpp REQUIRED)
endif()
if(NOT TARGET JsonCpp::JsonCpp)
  add_library(JsonCpp::JsonCpp INTERFACE IMPORTED)
  target_link_libraries(JsonCpp::JsonCpp INTERFACE jsoncpp_lib)
endif()

ttsdf_library(ttsdf_mapping
  SOURCES
    # depth in: images, folders, clouds -> volume
    src/frames/depth_image.cpp
    src/frames/depth_image_io.cpp
    src/frames/frame_check.cpp
    src/frames/frame_folder.cpp
    src/frames/frame_layouts.cpp
    src/frames/intrinsics_files.cpp
    src/frames/trajectory_file.cpp
    src/frames/pinhole.cpp
    src/frames/stray_poses.cpp
    src/fusion/depth/surface_pixels.cpp
    src/fusion/depth/depth_pyramid.cpp
    src/fusion/depth/view_blocks.cpp
    src/fusion/depth/surface_guard.cpp
    src/fusion/depth/block_update.cpp
    src/fusion/depth/depth_fusion.cpp
    src/fusion/cloud_fusion.cpp
    src/fusion/cloud_normals.cpp
    src/fusion/cloud_surface.cpp
    src/fusion/tsdf_volume.cpp
    src/fusion/vdb/vdb_import.cpp
    src/fusion/vdb/vdb_io.cpp
    src/fusion/vdb/vdb_reader.cpp
    src/fusion/volume_parts.cpp
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
    src/mesh/gltf_data.cpp
    src/mesh/gltf_file.cpp
    src/mesh/scene_file.cpp
    src/mesh/mesh_sides.cpp
    src/mesh/mesh_sampling.cpp
    # signed field -> compressed map
    src/build_steps/build_options.cpp
    src/build_steps/extent.cpp
    src/mapping/build_report.cpp
    src/mapping/field_slabs.cpp
    src/mapping/compression.cpp
    # do frames agree with each other
    src/agreement/volume_field.cpp
    src/agreement/frame_comparison.cpp
    src/agreement/agreement_summary.cpp
  PUBLIC ttsdf_core ttsdf_compression ttsdf_readers
  PRIVATE OpenVDB::openvdb ${TTSDF_TBB_LIBRARY} JsonCpp::JsonCpp ${TTSDF_ASSIMP_LIBRARY} ${VIGRAIMPEX_LIBRARY}
  INCLUDE ${VIGRA_INCLUDE_DIR})

# depth in
set(TTSDF_VDB_TEST_LIBS ttsdf_mapping OpenVDB::openvdb ${TTSDF_TBB_LIBRARY})
ttsdf_unit_test(frames/frame_folder_test.cpp LIBS ttsdf_mapping ${VIGRAIMPEX_LIBRARY})
ttsdf_unit_test(frames/frame_mistakes_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(frames/frame_layouts_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(frames/pinhole_test.cpp LIBS ttsdf_mapping)
ttsdf_unit_test(fusion/depth_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/block_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/carving_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/cloud_fusion_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/vdb_io_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
ttsdf_unit_test(fusion/volume_parts_test.cpp LIBS ${TTSDF_VDB_TEST_LIBS})
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
ttsdf_unit_test(mesh/gltf_test.cpp LIBS ttsdf_mapping)

# agreement
ttsdf_unit_test(agreement/frame_comparison_test.cpp LIBS ttsdf_mapping)

# all of it
ttsdf_unit_test(mapping/compression_test.cpp LIBS ttsdf_mapping)
