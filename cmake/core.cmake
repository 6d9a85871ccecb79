# Layer 1: the tensor train, the field, registration, the map file. Eigen, zlib, liblzma; nothing else.
find_package(ZLIB REQUIRED)
ttsdf_find_library(LZMA_LIBRARY lzma)

# Square roots of non-negative numbers only: without errno they become vector instructions. Vectors never cross a call.
set_source_files_properties(src/registration/solver/residual_kernels.cpp src/field/grid_locator.cpp PROPERTIES
  COMPILE_OPTIONS "-fno-math-errno;-fno-trapping-math;-Wno-psabi")
ttsdf_library(ttsdf_core
  SOURCES
    src/files/file_writer.cpp
    src/options/option_table.cpp
    src/map/tt_sdf_map.cpp
    src/map/format/byte_io.cpp
    src/map/codec/byte_compression.cpp
    src/map/codec/mask_coding.cpp
    src/map/format/map_sections.cpp
    src/map/format/map_container.cpp
    src/map/codec/coefficients/cosine_transform.cpp
    src/map/codec/coefficients/magnitude_tables.cpp
    src/map/codec/coefficients/coefficient_coder.cpp
    src/map/codec/bit_model.cpp
    src/map/codec/quantized_cores.cpp
    src/map/format/encoding.cpp
    src/map/map_io.cpp
    src/map/map_file.cpp
    src/geometry/se3.cpp
    src/tensor/dense_tensor.cpp
    src/tensor/tensor_train.cpp
    src/tensor/gemm.cpp
    src/field/support_mask.cpp
    src/field/grid_geometry.cpp
    src/field/distance_field.cpp
    src/field/grid_locator.cpp
    src/field/dense_distance_field.cpp
    src/field/compressed/quantized_bricks.cpp
    src/field/compressed/stored_cores.cpp
    src/field/compressed/column_cache.cpp
    src/field/compressed/surface_bricks.cpp
    src/field/nearest_feet.cpp
    src/field/compressed/tt_distance_field.cpp
    src/field/compressed/derivative_core_field.cpp
    src/field/long_range_field.cpp
    src/registration/scan_buffer.cpp
    src/registration/solver/linearizer.cpp
    src/registration/solver/residual_kernels.cpp
    src/registration/solver/minimizer.cpp
    src/registration/verification/uncertainty.cpp
    src/registration/result.cpp
    src/registration/pose_prior.cpp
    src/registration/registration_options.cpp
    src/registration/verification/verification.cpp
    src/registration/registration.cpp
    src/registration/hypotheses.cpp
    src/registration/acceptance.cpp
    src/registration/multi_start/descent.cpp
    src/registration/multi_start/multi_start.cpp
    src/registration/verification/ray_check.cpp
    src/registration/multi_start/start_poses.cpp
    src/registration/multi_start/search.cpp
    src/registration/multi_start/global_localization.cpp
    src/localization/localization_types.cpp
    src/localization/localizer_options.cpp
    src/localization/gates.cpp
    src/localization/pose_covariance.cpp
    src/localization/motion_model.cpp
    src/localization/global_job.cpp
    src/localization/localizer.cpp
    src/localization/localizer_recovery.cpp
    src/localization/localizer_silence.cpp
    src/localization/localizer_tracking.cpp
    src/field/frame_agreement.cpp
    src/sensor/sensor_model.cpp
  PUBLIC Eigen3::Eigen Threads::Threads
  PRIVATE ZLIB::ZLIB ${LZMA_LIBRARY})

ttsdf_unit_test(files/file_writer_test.cpp LIBS ttsdf_core)
# A map seen from above, for planners: so little that the map server can offer it.
ttsdf_library(ttsdf_occupancy SOURCES src/exports/export_file.cpp src/exports/occupancy.cpp PUBLIC ttsdf_core)

ttsdf_unit_test(localization/pose_covariance_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(localization/motion_model_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(localization/gates_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(localization/localizer_recovery_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(localization/localizer_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(localization/time_jump_test.cpp LIBS ttsdf_core)
ttsdf_unit_test(localization/handheld_test.cpp LIBS ttsdf_core)
