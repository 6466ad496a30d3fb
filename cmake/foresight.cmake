# The four shapes of target that the tree is made of: a library, a program, a process, a test.

add_library(foresight_options INTERFACE)
target_include_directories(foresight_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(foresight_options INTERFACE -Wall -Wextra -Wshadow -Wconversion
                                                   -Wno-sign-conversion
                                                   # False alarms of GCC 12 on std::string.
                                                   -Wno-restrict)
if(FORESIGHT_SANITIZE)
  target_compile_options(foresight_options INTERFACE -fsanitize=address,undefined
                                                     -fno-sanitize-recover=undefined
                                                     -fno-omit-frame-pointer -g1)
  target_link_options(foresight_options INTERFACE -fsanitize=address,undefined)
endif()

# Time-outs only end what hangs; a sanitized program on a busy machine is many times slower.
set(FORESIGHT_TEST_TIMEOUT_S 600)
if(FORESIGHT_SANITIZE)
  set(FORESIGHT_TEST_TIMEOUT_S 3600)
endif()

# More than half of the compiler's time goes into reading the standard library, Eigen and GoogleTest:
# they are read once. Sources still include all that they use: -DFORESIGHT_PRECOMPILE=OFF tells.
option(FORESIGHT_PRECOMPILE "Read the headers that nearly everybody includes only once" ON)
set(FORESIGHT_COMMON_HEADERS <algorithm> <array> <cmath> <cstdint> <cstdio> <deque> <filesystem>
    <functional> <limits> <map> <memory> <optional> <random> <set> <span> <sstream> <string>
    <utility> <vector> <Eigen/Core> <Eigen/Geometry>)

# foresight_precompiled(NAME DEPS target … HEADERS …): what others take with foresight_precompile().
function(foresight_precompiled name)
  cmake_parse_arguments(ARG "" "" "DEPS;HEADERS" ${ARGN})
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/${name}.cc CONTENT "")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/generated/${name}.cc)
  target_link_libraries(${name} PRIVATE foresight_options ${ARG_DEPS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()
if(FORESIGHT_PRECOMPILE)
  foresight_precompiled(precompiled DEPS Eigen3::Eigen HEADERS ${FORESIGHT_COMMON_HEADERS})
  foresight_precompiled(precompiled_tests DEPS Eigen3::Eigen GTest::gtest
                        HEADERS ${FORESIGHT_COMMON_HEADERS} <gtest/gtest.h>)
endif()

function(foresight_precompile target from)
  if(FORESIGHT_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${from})
  endif()
endfunction()

# foresight_library(NAME SOURCES a.cc … DEPS target …)
function(foresight_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC foresight_options ${ARG_DEPS})
  foresight_precompile(${name} precompiled)
endfunction()

# foresight_program(NAME SOURCES main.cc … DEPS target …)
function(foresight_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE foresight_options ${ARG_DEPS})
  foresight_precompile(${name} precompiled)
endfunction()

# foresight_process(NAME SOURCES process.cc … DEPS target …)
#   library NAME_process (to run it inside a test or the one-thread swarm)
#   program foresight-NAME, from main.cc
function(foresight_process name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  foresight_library(${name}_process SOURCES ${ARG_SOURCES} DEPS common ${ARG_DEPS})
  foresight_program(foresight-${name} SOURCES main.cc DEPS ${name}_process)
endfunction()

# foresight_test(NAME SOURCES a_test.cc … DEPS target …): a GoogleTest program.
function(foresight_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE foresight_options ${ARG_DEPS} GTest::gtest_main)
  foresight_precompile(${name} precompiled_tests)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${FORESIGHT_TEST_TIMEOUT_S})
endfunction()
