# Files of public bug reports, made anew; those in the folder TTSDF_FIELD_CASES, too, if it is set.
if(TTSDF_BUILD_TESTS)
  add_executable(field_volumes test/field_cases/volumes.cpp)
  target_link_libraries(field_volumes OpenVDB::openvdb ${TTSDF_TBB_LIBRARY} ttsdf_warnings)
  add_test(NAME field_cases_test COMMAND "${TTSDF_PYTHON_FOR_MODULE}" -B
    "${CMAKE_CURRENT_SOURCE_DIR}/test/field_cases/field_cases_test.py" "$<TARGET_FILE_DIR:ttsdf_build>" $<TARGET_FILE:field_volumes>)
  set_tests_properties(field_cases_test PROPERTIES TIMEOUT 900)
endif()
