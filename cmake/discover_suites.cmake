# Run after a test program is linked (see shapedb_test): writes what ctest runs, one test for each suite. A process
# for each test would make expensive inputs again for every test that shares them.
#   cmake -D PROGRAM=path -D PREFIX=core -D OUTPUT=file -D TIMEOUT=seconds -D LABEL=name -P discover_suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listing RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${PROGRAM} cannot list its tests: ${failed}")
endif()
string(REGEX MATCHALL "(^|\n)[A-Za-z][A-Za-z0-9_/]*\\." suites "${listing}")
if(NOT suites)
  message(FATAL_ERROR "${PROGRAM} has no tests")
endif()
set(content "")
foreach(suite ${suites})
  string(STRIP "${suite}" suite)
  set(test "${PREFIX}.${suite}")
  string(REGEX REPLACE "\\.$" "" test "${test}")
  string(APPEND content "add_test([=[${test}]=] [=[${PROGRAM}]=] \"--gtest_filter=${suite}*\")\n"
         "set_tests_properties([=[${test}]=] PROPERTIES TIMEOUT ${TIMEOUT} LABELS [=[${LABEL}]=])\n")
endforeach()
file(WRITE ${OUTPUT} "${content}")
