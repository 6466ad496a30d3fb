# The three shapes of target that the tree is made of: a library, a process, a test.

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

# foresight_library(NAME SOURCES a.cc … DEPS target …)
function(foresight_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC foresight_options ${ARG_DEPS})
endfunction()

# foresight_process(NAME SOURCES process.cc … DEPS target …)
#   library NAME_process (to run it inside a test or the one-thread swarm)
#   program foresight-NAME, from main.cc
function(foresight_process name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  foresight_library(${name}_process SOURCES ${ARG_SOURCES} DEPS common ${ARG_DEPS})
  add_executable(foresight-${name} main.cc)
  target_link_libraries(foresight-${name} PRIVATE ${name}_process)
endfunction()

# foresight_test(NAME SOURCES a_test.cc … DEPS target …): a GoogleTest program.
function(foresight_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE foresight_options ${ARG_DEPS} GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${FORESIGHT_TEST_TIMEOUT_S})
endfunction()
