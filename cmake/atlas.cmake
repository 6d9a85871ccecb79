# Many maps: the folder that holds them, the field of all of them, loading beside the scans. The robot's side.
ttsdf_find_library(TTSDF_LIBYAML_LIBRARY yaml)
ttsdf_library(ttsdf_yaml SOURCES src/yaml/plain_yaml.cpp PUBLIC ${YAML_CPP_LIBRARIES} PRIVATE ${TTSDF_LIBYAML_LIBRARY})

ttsdf_library(ttsdf_atlas
  SOURCES
    src/atlas/oriented_box.cpp
    src/atlas/box_tree.cpp
    src/atlas/atlas.cpp
    src/atlas/atlas_yaml.cpp
    src/atlas/atlas_members.cpp
    src/atlas/atlas_field.cpp
    src/atlas/atlas_far_field.cpp
    src/atlas/map_ranking.cpp
    src/atlas/map_shelf.cpp
    src/atlas/map_difference.cpp
    src/atlas/atlas_loader.cpp
    src/atlas/scan_views.cpp
    src/atlas/place_index.cpp
    src/atlas/place_index_file.cpp
    src/atlas/search_window.cpp
    src/atlas/atlas_search.cpp
    src/atlas/moving_search.cpp
    src/atlas/atlas_locator.cpp
  PUBLIC ttsdf_core
  PRIVATE ttsdf_yaml ZLIB::ZLIB Threads::Threads)
