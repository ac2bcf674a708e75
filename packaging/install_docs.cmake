# SPDX-License-Identifier: GPL-3.0-or-later
# Run by the installation of the documentation. Expects SOURCE, BUILD, PYTHON and FOLDER (below the prefix).
set(pages ${BUILD}/packaging/docs)
execute_process(COMMAND ${PYTHON} -B ${SOURCE}/scripts/installed_docs.py ${pages} COMMAND_ERROR_IS_FATAL ANY)
file(INSTALL ${pages}/ DESTINATION ${CMAKE_INSTALL_PREFIX}/${FOLDER})
