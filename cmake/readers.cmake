# Files of triangles and points, read strictly and in double precision; the process that other libraries' readers run in.
# Eigen only.
ttsdf_library(ttsdf_readers
  SOURCES
    src/readers/child_process.cpp
    src/readers/cloud_file.cpp
    src/readers/file_bytes.cpp
    src/readers/mesh_formats.cpp
    src/readers/pcd_file.cpp
    src/readers/ply_file.cpp
    src/readers/split_polygon.cpp
    src/readers/text_cloud.cpp
    src/readers/triangle_soup.cpp
  PUBLIC Eigen3::Eigen)

ttsdf_unit_test(readers/triangle_file_test.cpp LIBS ttsdf_readers)
ttsdf_unit_test(readers/cloud_file_test.cpp LIBS ttsdf_readers)
ttsdf_unit_test(readers/child_process_test.cpp LIBS ttsdf_readers)
