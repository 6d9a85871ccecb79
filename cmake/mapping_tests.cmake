# Tests of the mapping layer (test/mapping).
foreach(test block_fusion carving cloud_fusion compression depth_fusion frame_folder pinhole real_frames sampled_field vdb_io)
  ttsdf_unit_test(mapping/${test}_test.cpp LIBS ttsdf_mapping OpenVDB::openvdb TBB::tbb ${VIGRAIMPEX_LIBRARY}
    INCLUDE ${VIGRA_INCLUDE_DIR})
endforeach()
