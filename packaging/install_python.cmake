# SPDX-License-Identifier: GPL-3.0-or-later
# Run by the installation of the Python package. Expects BUILD (folder of the build) and PYTHON. Debian's Python looks
# into these folders; with another prefix PYTHONPATH has to name lib/python3/dist-packages below it.
set(folder lib/python3/dist-packages)
if(CMAKE_INSTALL_PREFIX MATCHES "^/usr/local/?$")
  execute_process(COMMAND ${PYTHON} -c "import sys; print('%d.%d' % sys.version_info[:2])" OUTPUT_VARIABLE version
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  set(folder lib/python${version}/dist-packages)
endif()
file(INSTALL ${BUILD}/python/src/shapedb DESTINATION ${CMAKE_INSTALL_PREFIX}/${folder} PATTERN __pycache__ EXCLUDE)
