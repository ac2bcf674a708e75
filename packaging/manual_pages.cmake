# SPDX-License-Identifier: GPL-3.0-or-later
# Run by the build: manual pages and completions, as the programs print them, into OUTPUT. Expects SHAPEDB, SHAPEDBD.
file(REMOVE_RECURSE ${OUTPUT})
file(MAKE_DIRECTORY ${OUTPUT}/man1 ${OUTPUT}/man8 ${OUTPUT}/completions)
execute_process(COMMAND ${SHAPEDBD} man OUTPUT_FILE ${OUTPUT}/man8/shapedbd.8 COMMAND_ERROR_IS_FATAL ANY)
if(SHAPEDB)
  execute_process(COMMAND ${SHAPEDB} man --out ${OUTPUT}/man1 OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  foreach(shell bash zsh fish)
    execute_process(COMMAND ${SHAPEDB} completion ${shell} OUTPUT_FILE ${OUTPUT}/completions/${shell} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endif()
file(GLOB pages ${OUTPUT}/man?/*)
execute_process(COMMAND gzip -9n ${pages} COMMAND_ERROR_IS_FATAL ANY)
