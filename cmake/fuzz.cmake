# Fuzz targets: test/fuzz/<target>.cpp. With clang and TTSDF_LIBFUZZER they are libFuzzer's programs, otherwise each has a
# small main that changes the inputs at random. scripts/fuzz runs them for as long as one likes.
if(NOT TTSDF_BUILD_TESTS OR NOT CATKIN_ENABLE_TESTING)
  return()
endif()
option(TTSDF_LIBFUZZER "Fuzz targets with libFuzzer (clang only)" OFF)

set(TTSDF_FUZZ_CORPUS "${CMAKE_CURRENT_BINARY_DIR}/fuzz_corpus")
add_executable(make_fuzz_corpus EXCLUDE_FROM_ALL test/fuzz/make_corpus.cpp)
target_link_libraries(make_fuzz_corpus ttsdf_ros ttsdf_compression PNG::PNG ttsdf_warnings)
add_custom_command(OUTPUT "${TTSDF_FUZZ_CORPUS}/made" COMMAND make_fuzz_corpus "${TTSDF_FUZZ_CORPUS}"
  COMMAND ${CMAKE_COMMAND} -E touch "${TTSDF_FUZZ_CORPUS}/made" DEPENDS make_fuzz_corpus VERBATIM)
add_custom_target(fuzz_corpus DEPENDS "${TTSDF_FUZZ_CORPUS}/made")

# ttsdf_fuzz_target(<name> LIBS ...): program fuzz_<name>; a test runs it for some seconds.
function(ttsdf_fuzz_target name)
  cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
  add_executable(fuzz_${name} EXCLUDE_FROM_ALL test/fuzz/${name}.cpp)
  target_link_libraries(fuzz_${name} ${ARG_LIBS} ttsdf_warnings)
  if(TTSDF_LIBFUZZER)
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  else()
    target_sources(fuzz_${name} PRIVATE test/fuzz/standalone.cpp)
  endif()
  add_dependencies(fuzz_${name} fuzz_corpus)
  add_dependencies(tests fuzz_${name})
  add_test(NAME fuzz_${name} COMMAND fuzz_${name} -max_total_time=10 "${TTSDF_FUZZ_CORPUS}/${name}"
    "${CMAKE_CURRENT_SOURCE_DIR}/test/fuzz/cases")
  set_tests_properties(fuzz_${name} PROPERTIES TIMEOUT 120)
endfunction()

ttsdf_fuzz_target(map_reader LIBS ttsdf_core)
ttsdf_fuzz_target(map_message LIBS ttsdf_ros)
ttsdf_fuzz_target(point_cloud LIBS ttsdf_ros)
ttsdf_fuzz_target(depth_image LIBS ttsdf_ros)
if(TTSDF_BUILD_MAPPING)
  ttsdf_fuzz_target(cloud_file LIBS ttsdf_readers)
  ttsdf_fuzz_target(mesh_file LIBS ttsdf_readers)
  ttsdf_fuzz_target(frame_folder LIBS ttsdf_mapping)
  ttsdf_fuzz_target(text_file LIBS ttsdf_tools ttsdf_mapping ttsdf_atlas ttsdf_statistics)
endif()
