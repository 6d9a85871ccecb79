# From a dense array to a map file: TT-SVD, weighted and sparse fits, quantisation, encoding. The builder's side: no robot
# needs it.
ttsdf_library(ttsdf_compression
  SOURCES
    src/compression/dense_slabs.cpp
    src/compression/sparse_fit.cpp
    src/compression/quantized_fit.cpp
    src/compression/compact_map.cpp
    src/compression/gram.cpp
    src/compression/tt_svd.cpp
    src/compression/tt_weighted.cpp
    # cores -> bytes
    src/compression/encoder/train_gauge.cpp
    src/compression/encoder/live_components.cpp
    src/compression/encoder/core_quantizer.cpp
    src/compression/encoder/byte_writer.cpp
    src/compression/encoder/byte_compressor.cpp
    src/compression/encoder/mask_writer.cpp
    src/compression/encoder/core_writer.cpp
    src/compression/encoder/section_writer.cpp
    src/compression/map_writer.cpp
  PUBLIC ttsdf_core
  PRIVATE Threads::Threads ${LZMA_LIBRARY})

ttsdf_unit_test(compression/gram_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(compression/tt_svd_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(compression/tt_weighted_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(compression/compact_map_test.cpp LIBS ttsdf_compression)
