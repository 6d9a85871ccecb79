# Unit tests of the map: its file, its encodings, its fits.
ttsdf_unit_test(map/tt_sdf_map_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(map/map_io_test.cpp LIBS ttsdf_compression ZLIB::ZLIB)
ttsdf_unit_test(map/map_format_error_test.cpp LIBS ttsdf_compression ZLIB::ZLIB)
ttsdf_unit_test(map/map_file_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(map/mask_section_test.cpp LIBS ttsdf_compression)
ttsdf_unit_test(map/quantized_cores_test.cpp LIBS ttsdf_compression)
