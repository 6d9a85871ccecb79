# From a dense array to a tensor train: TT-SVD, weighted and sparse fits, ranks and encoding of a map. The builder's side: no
# robot needs it.
ttsdf_library(ttsdf_compression
  SOURCES
    src/compression/dense_slabs.cpp
    src/compression/sparse_fit.cpp
    src/compression/compact_map.cpp
    src/compression/gram.cpp
    src/compression/tt_svd.cpp
    src/compression/tt_weighted.cpp
  PUBLIC ttsdf_core
  PRIVATE Threads::Threads)

ttsdf_unit_test(compression/gram_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(compression/tt_svd_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(compression/tt_weighted_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(compression/compact_map_test.cpp LIBS ttsdf_compression)
