# Maps from and to other programs' formats: meshes, clouds, OpenVDB, octrees.
ttsdf_find_library(TTSDF_OCTOMAP_LIBRARY octomap)
ttsdf_find_library(TTSDF_OCTOMATH_LIBRARY octomath)

ttsdf_library(ttsdf_exports
  SOURCES
    src/exports/export_ending.cpp
    src/exports/grid_files.cpp
    src/exports/octomap_export.cpp
    src/exports/octomap_import.cpp
    src/exports/surface_files.cpp
  PUBLIC ttsdf_core ttsdf_mapping ttsdf_occupancy
  PRIVATE OpenVDB::openvdb ${TTSDF_TBB_LIBRARY} ${TTSDF_OCTOMAP_LIBRARY} ${TTSDF_OCTOMATH_LIBRARY})
