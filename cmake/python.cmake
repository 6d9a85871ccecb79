# The Python module `ttsdf`, beside the messages' Python code, where `. devel/setup.bash` makes it known.
option(TTSDF_BUILD_PYTHON "Build the Python module (needs pybind11)" ON)
find_path(PYBIND11_INCLUDE_DIR pybind11/pybind11.h)
mark_as_advanced(PYBIND11_INCLUDE_DIR)
if(PYTHON_EXECUTABLE)
  set(TTSDF_PYTHON_FOR_MODULE "${PYTHON_EXECUTABLE}")
else()
  set(TTSDF_PYTHON_FOR_MODULE /usr/bin/python3)
endif()
execute_process(COMMAND "${TTSDF_PYTHON_FOR_MODULE}" -c
  "import sysconfig as s; print(s.get_path('include') + ';' + s.get_config_var('EXT_SUFFIX'), end='')"
  OUTPUT_VARIABLE TTSDF_PYTHON_CONFIG RESULT_VARIABLE TTSDF_PYTHON_FAILED ERROR_QUIET)
if(NOT TTSDF_PYTHON_FAILED)
  list(GET TTSDF_PYTHON_CONFIG 0 TTSDF_PYTHON_INCLUDE_DIR)
  list(GET TTSDF_PYTHON_CONFIG 1 TTSDF_PYTHON_SUFFIX)
endif()

if(NOT TTSDF_BUILD_PYTHON)
  message(STATUS "Python module: switched off")
elseif(NOT PYBIND11_INCLUDE_DIR OR TTSDF_PYTHON_FAILED OR NOT EXISTS "${TTSDF_PYTHON_INCLUDE_DIR}/Python.h")
  message(STATUS "Python module: left out, wanted pybind11 (pybind11-dev) and Python's headers (python3-dev)")
else()
  add_library(ttsdf_python MODULE
    python/arguments.cpp
    python/builds.cpp
    python/map_object.cpp
    python/readers.cpp
    python/registration_object.cpp
    python/ttsdf_module.cpp)
  target_include_directories(ttsdf_python SYSTEM PRIVATE "${PYBIND11_INCLUDE_DIR}" "${TTSDF_PYTHON_INCLUDE_DIR}")
  target_link_libraries(ttsdf_python PRIVATE ttsdf_exports ttsdf_mapping ttsdf_core ttsdf_warnings)
  # pybind11's own classes are hidden; a type that holds one must be as well.
  set_target_properties(ttsdf_python PROPERTIES
    PREFIX "" OUTPUT_NAME ttsdf SUFFIX "${TTSDF_PYTHON_SUFFIX}" CXX_VISIBILITY_PRESET hidden)
  if(TTSDF_BUILD_ROS)
    set_target_properties(ttsdf_python PROPERTIES
      LIBRARY_OUTPUT_DIRECTORY "${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_PYTHON_DESTINATION}")
    install(TARGETS ttsdf_python LIBRARY DESTINATION ${CATKIN_GLOBAL_PYTHON_DESTINATION} COMPONENT tools)  # where catkin's messages go, too
  else()
    install(TARGETS ttsdf_python LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/python3/dist-packages)
  endif()
  if(TTSDF_BUILD_TESTS)
    add_test(NAME python_module_test COMMAND "${TTSDF_PYTHON_FOR_MODULE}" -B
      "${CMAKE_CURRENT_SOURCE_DIR}/test/python/module_test.py" "$<TARGET_FILE_DIR:ttsdf_python>" "$<TARGET_FILE_DIR:ttsdf_build>")
    add_test(NAME python_arguments_test COMMAND "${TTSDF_PYTHON_FOR_MODULE}" -B
      "${CMAKE_CURRENT_SOURCE_DIR}/test/python/arguments_test.py" "$<TARGET_FILE_DIR:ttsdf_python>")
  endif()
endif()
