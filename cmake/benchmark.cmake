# Benchmarks (TTSDF_BUILD_BENCHMARKS): one program per layer, on the simulated apartment.
find_package(benchmark REQUIRED)

foreach(name field iteration registration map)
  add_executable(${name}_benchmark benchmark/${name}_benchmark.cpp benchmark/benchmark_world.cpp)
  target_include_directories(${name}_benchmark PRIVATE benchmark)
  target_link_libraries(${name}_benchmark PRIVATE
    ttsdf_simulation ttsdf_mapping ttsdf_core benchmark::benchmark benchmark::benchmark_main ttsdf_warnings)
endforeach()

# One run of a whole building: minutes and a gigabyte, so no loop around it.
add_executable(building_benchmark benchmark/building_benchmark.cpp)
target_link_libraries(building_benchmark PRIVATE
  ttsdf_tools ttsdf_simulation ttsdf_mapping ttsdf_core ttsdf_warnings)

# Figures, not times.
add_executable(field_accuracy benchmark/field_accuracy.cpp)
target_link_libraries(field_accuracy PRIVATE
  ttsdf_tools ttsdf_simulation ttsdf_mapping ttsdf_core ttsdf_warnings)

add_executable(atlas_drive benchmark/atlas_drive.cpp)
target_link_libraries(atlas_drive PRIVATE ttsdf_atlas ttsdf_mapping ttsdf_core ttsdf_warnings)

add_executable(atlas_hotel benchmark/atlas_hotel.cpp benchmark/hotel_search.cpp benchmark/hotel_benchmark.cpp)
target_link_libraries(atlas_hotel PRIVATE ttsdf_atlas ttsdf_simulation ttsdf_mapping ttsdf_core ttsdf_warnings)
