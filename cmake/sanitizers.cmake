# In a sanitized build the nodelet manager, which is not this package's program, loads libraries of this package. The
# sanitizer's runtime must be in a process before them: a program `nodelet` in the development space, which roslaunch and
# rosrun take before that of the system, loads it first.
if(TTSDF_SANITIZE MATCHES "address")
  set(TTSDF_RUNTIME asan)
elseif(TTSDF_SANITIZE MATCHES "thread")
  set(TTSDF_RUNTIME tsan)
else()
  return()
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(TTSDF_RUNTIME lib${TTSDF_RUNTIME}.so)
else()
  set(TTSDF_RUNTIME libclang_rt.${TTSDF_RUNTIME}-${CMAKE_SYSTEM_PROCESSOR}.so)
endif()
execute_process(COMMAND "${CMAKE_CXX_COMPILER}" -print-file-name=${TTSDF_RUNTIME}
  OUTPUT_VARIABLE TTSDF_RUNTIME_FILE OUTPUT_STRIP_TRAILING_WHITESPACE)
find_program(TTSDF_NODELET nodelet PATHS "${nodelet_PREFIX}/lib/nodelet" /usr/lib/nodelet NO_DEFAULT_PATH)
mark_as_advanced(TTSDF_NODELET)
if(TTSDF_NODELET AND EXISTS "${TTSDF_RUNTIME_FILE}")
  file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/sanitizers/nodelet"
    "#!/bin/sh\nLD_PRELOAD='${TTSDF_RUNTIME_FILE}' exec '${TTSDF_NODELET}' \"$@\"\n")
  file(COPY "${CMAKE_CURRENT_BINARY_DIR}/sanitizers/nodelet" DESTINATION "${CATKIN_DEVEL_PREFIX}/lib/nodelet"
    FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
else()
  message(STATUS "sanitizers: no ${TTSDF_RUNTIME} here, or no nodelet; rostests of nodelets will fail")
endif()
