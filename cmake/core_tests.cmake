# Unit tests of the core layer: options, geometry, tensor train, field, registration.
include(cmake/map_tests.cmake)
ttsdf_unit_test(options/option_table_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(geometry/se3_test.cpp LIBS ttsdf_core)

ttsdf_unit_test(tensor/tensor_train_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(tensor/differentiate_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(tensor/round_test.cpp LIBS ttsdf_compression)

ttsdf_unit_test(field/frame_agreement_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(field/grid_geometry_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(field/support_mask_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(field/stored_cores_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(field/quantized_bricks_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(field/derivative_core_field_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(field/distance_field_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(field/tt_distance_field_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(field/long_range_field_test.cpp LIBS ttsdf_core)

ttsdf_unit_test(registration/scan_buffer_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(registration/linearizer_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(registration/registration_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(registration/far_origin_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(registration/covariance_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(registration/ray_check_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(registration/start_poses_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(registration/search_test.cpp LIBS ttsdf_core)

