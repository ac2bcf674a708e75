# One way to declare a library and a test, so that warnings, sanitizers and include
# paths are the same everywhere.

find_program(SHAPEDB_CCACHE ccache)
if(SHAPEDB_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SHAPEDB_CCACHE})
endif()
find_program(SHAPEDB_MOLD mold)
if(SHAPEDB_MOLD)
  add_link_options(-fuse-ld=mold)
endif()

add_library(shapedb_options INTERFACE)
target_include_directories(shapedb_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_features(shapedb_options INTERFACE cxx_std_17)
target_compile_options(shapedb_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                                                 -Woverloaded-virtual -Wno-psabi)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # g++ 12.2's vectoriser of straight-line code drops the rounding of double -> float -> double
  # in loops over structs of three doubles: points would not be what the wire carries.
  target_compile_options(shapedb_options INTERFACE -fno-tree-slp-vectorize)
endif()
if(SHAPEDB_WARNINGS_AS_ERRORS)
  target_compile_options(shapedb_options INTERFACE -Werror)
endif()
if(SHAPEDB_SANITIZE)
  # With sanitizers g++ suspects values unset that are not, in its own library too.
  add_compile_options(-Wno-maybe-uninitialized)
  add_compile_options(-fsanitize=${SHAPEDB_SANITIZE} -fno-omit-frame-pointer -g)
  add_link_options(-fsanitize=${SHAPEDB_SANITIZE})
endif()

# shapedb_library(NAME SOURCES a.cpp ... [PUBLIC lib ...] [PRIVATE lib ...])
function(shapedb_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC shapedb_options ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
endfunction()

# shapedb_test(NAME [SUPPORT file.cpp ...] LIBS lib ... [TIMEOUT seconds]): one executable of every
# *_test.cpp in the current folder; a test file cannot be left out by forgetting to list it.
function(shapedb_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SUPPORT;LIBS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_test.cpp)
  add_executable(${name} ${sources} ${ARG_SUPPORT})
  target_link_libraries(${name} PRIVATE shapedb_options ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${ARG_TIMEOUT})
endfunction()
