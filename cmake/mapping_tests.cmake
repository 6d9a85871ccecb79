# Tests of the mapping layer that span several of its parts.
foreach(test compression sampled_field)
  if(NOT TARGET mapping_${test}_test)
    ttsdf_unit_test(mapping/${test}_test.cpp LIBS ttsdf_mapping)
  endif()
endforeach()
