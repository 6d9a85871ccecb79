ttsdf_unit_test(atlas/oriented_box_test.cpp LIBS ttsdf_atlas)
ttsdf_unit_test(atlas/atlas_test.cpp LIBS ttsdf_atlas ttsdf_compression)
ttsdf_unit_test(atlas/atlas_field_test.cpp LIBS ttsdf_atlas ttsdf_compression)
ttsdf_unit_test(atlas/atlas_loader_test.cpp LIBS ttsdf_atlas ttsdf_compression)
