# Tests that keep doc/ true.
if(PYTHON_EXECUTABLE)
  set(TTSDF_PYTHON "${PYTHON_EXECUTABLE}")
else()
  find_package(Python3 COMPONENTS Interpreter)
  set(TTSDF_PYTHON "${Python3_EXECUTABLE}")
endif()

ttsdf_unit_test(documentation/map_format_test.cpp LIBS ttsdf_core ZLIB::ZLIB)
if(TARGET documentation_map_format_test)
  target_compile_definitions(documentation_map_format_test PRIVATE
    TTSDF_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}" TTSDF_PYTHON="${TTSDF_PYTHON}")
endif()
