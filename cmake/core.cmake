# Layer 1: the tensor train, the field, registration, the map file. Eigen, zlib, zstd; nothing else.
find_package(Eigen3 REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Threads REQUIRED)
find_library(ZSTD_LIBRARY zstd REQUIRED)
find_library(LZMA_LIBRARY lzma REQUIRED)

ttsdf_library(ttsdf_core
  SOURCES
    src/options/option_table.cpp
  PUBLIC Eigen3::Eigen
  PRIVATE ZLIB::ZLIB Threads::Threads ${ZSTD_LIBRARY} ${LZMA_LIBRARY})
