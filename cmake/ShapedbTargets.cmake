# SPDX-License-Identifier: GPL-3.0-or-later
# How libraries and tests are declared: warnings, optimisation, precompiled headers, sanitizers and include paths
# are the same everywhere.

find_program(SHAPEDB_CCACHE ccache)
if(SHAPEDB_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Without this ccache never reuses files that include precompiled headers.
  set(CMAKE_CXX_COMPILER_LAUNCHER
      env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${SHAPEDB_CCACHE})
endif()
find_program(SHAPEDB_MOLD mold)
if(SHAPEDB_MOLD)
  add_link_options(-fuse-ld=mold)
endif()

# -O3 only for libraries that gain by it (FAST): the others build in two thirds of the time without it.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")

add_library(shapedb_options INTERFACE)
target_include_directories(shapedb_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_features(shapedb_options INTERFACE cxx_std_17)
target_compile_options(shapedb_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                                                 -Woverloaded-virtual -Wno-psabi)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(shapedb_options INTERFACE -fpch-preprocess)  # for ccache
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # g++ 12.2's vectoriser of straight-line code drops the rounding of double -> float -> double
  # in loops over structs of three doubles: points would not be what the wire carries.
  target_compile_options(shapedb_options INTERFACE -fno-tree-slp-vectorize)
endif()
if(SHAPEDB_WARNINGS_AS_ERRORS)
  target_compile_options(shapedb_options INTERFACE -Werror)
endif()
if(SHAPEDB_SANITIZE)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # With sanitizers g++ takes initialised values for uninitialised ones, even in its own library.
    add_compile_options(-Wno-maybe-uninitialized)
    # Boost.Asio's fences are not followed: what only they order may be reported.
    if(SHAPEDB_SANITIZE STREQUAL "thread")
      add_compile_options(-Wno-tsan)
    endif()
  endif()
  # Lines are enough for reports; to follow variables takes g++ minutes and gigabytes for some sources.
  add_compile_options(-fsanitize=${SHAPEDB_SANITIZE} -fno-omit-frame-pointer -g1)
  add_link_options(-fsanitize=${SHAPEDB_SANITIZE})
endif()

if(SHAPEDB_BUILD_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

# With SHAPEDB_UNITY, six sources at a time are compiled as one: most of the time of a source goes into headers. Names
# of their anonymous namespaces must differ then.
function(shapedb_unity name)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${SHAPEDB_UNITY} UNITY_BUILD_BATCH_SIZE 6)
endfunction()

# shapedb_library(NAME SOURCES a.cpp ... [PUBLIC lib ...] [PRIVATE lib ...] [PCH header ... | PCH_OF target]
#                 [FAST | SMALL])
#   FAST    -O3: for loops over arrays (docs/development.md)
#   SMALL   -O1: runs once a command, compiles slowly
#   PCH     headers parsed once for the whole target. Not CLI11: each source would compile its global validators (3 s)
#   PCH_OF  the same, shared with a target of the same flags
function(shapedb_library name)
  cmake_parse_arguments(ARG "FAST;SMALL" "PCH_OF" "SOURCES;PUBLIC;PRIVATE;PCH" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC shapedb_options ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  if(ARG_FAST)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O3>)
  elseif(ARG_SMALL)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  if(ARG_PCH)
    target_precompile_headers(${name} PRIVATE ${ARG_PCH})
  elseif(ARG_PCH_OF)
    target_precompile_headers(${name} REUSE_FROM ${ARG_PCH_OF})
  endif()
  shapedb_unity(${name})
endfunction()

# shapedb_test(NAME FOLDERS folder ... [SUPPORT file.cpp ...] LIBS lib ... [PCH header ...] [TIMEOUT seconds] [LABEL name]
#              [SLOW suite ...] [TOGETHER suite ...] [COMPUTE]):
# one program of every *_test.cpp in and below the folders, so that no test file can be forgotten. ctest runs it once
# for each suite, those in SLOW first: started last, one of them would run alone. Suites in TOGETHER share expensive
# inputs: they run in one process, before those in SLOW. Built with -O0, for most of a test's time goes into compiling
# it; with -O1 where references COMPUTE much.
function(shapedb_test name)
  cmake_parse_arguments(ARG "COMPUTE" "TIMEOUT;LABEL" "FOLDERS;SUPPORT;LIBS;PCH;SLOW;TOGETHER" ${ARGN})
  set(patterns)
  foreach(folder ${ARG_FOLDERS})
    list(APPEND patterns ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*_test.cpp)
  endforeach()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${patterns})
  add_executable(${name} ${sources} ${ARG_SUPPORT})
  target_link_libraries(${name} PRIVATE shapedb_options ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  if(ARG_COMPUTE)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  else()
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O0>)
  endif()
  target_precompile_headers(${name} PRIVATE <gmock/gmock.h> <gtest/gtest.h> <algorithm> <array> <atomic> <chrono> <cmath>
                            <functional> <map> <memory> <optional> <string> <thread> <vector> "${PROJECT_SOURCE_DIR}/core/base/error.h"
                            ${ARG_PCH})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  shapedb_unity(${name})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  if(SHAPEDB_SANITIZE)
    math(EXPR ARG_TIMEOUT "12 * ${ARG_TIMEOUT}")
  endif()
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  string(REGEX REPLACE "^shapedb_|_test$" "" prefix ${name})
  set(suites ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
  set(discover ${PROJECT_SOURCE_DIR}/cmake/discover_suites.cmake)
  list(JOIN ARG_TOGETHER "," together)
  add_custom_command(
    TARGET ${name} POST_BUILD
    COMMAND ${CMAKE_COMMAND} -D PROGRAM=$<TARGET_FILE:${name}> -D PREFIX=${prefix} -D OUTPUT=${suites} -D
            TIMEOUT=${ARG_TIMEOUT} -D LABEL=${ARG_LABEL} -D TOGETHER=${together} -P ${discover}
    VERBATIM)
  set_property(TARGET ${name} APPEND PROPERTY LINK_DEPENDS ${discover})
  set(slowFirst "")
  foreach(suite ${ARG_SLOW})
    string(APPEND slowFirst "  set_tests_properties(${prefix}.${suite} PROPERTIES COST 10)\n")
  endforeach()
  # Before the first build ctest says that the program is missing instead of passing without it.
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${name}_include.cmake
       "if(EXISTS \"${suites}\")\n  include(\"${suites}\")\n${slowFirst}else()\n  add_test(${prefix}_NOT_BUILT ${name}_NOT_BUILT)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}_include.cmake)
endfunction()
