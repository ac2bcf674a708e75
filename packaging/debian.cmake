# SPDX-License-Identifier: GPL-3.0-or-later
# The Debian packages: one for each component. Packages they depend on come from the linked libraries (shlibdeps).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME shapedb)
# Else it is put before the description of each package.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_PACKAGE_VENDOR "The ShapeDB authors")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_OUTPUT_FILE_PREFIX packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL server client development python docs)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# Whatever the umask of who makes the packages.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
                                                WORLD_EXECUTE)

# shapedb_package(COMPONENT NAME SECTION "first line" "further text" [ALL] [DEPENDS ...] [SUGGESTS ...] [RECOMMENDS ...]
#                 [CONTROL file ...])
function(shapedb_package component name section summary text)
  cmake_parse_arguments(ARG "ALL" "DEPENDS;RECOMMENDS;SUGGESTS" "CONTROL" ${ARGN})
  string(TOUPPER ${component} key)
  set(values PACKAGE_NAME ${name} PACKAGE_SECTION ${section} FILE_NAME DEB-DEFAULT)
  if(ARG_ALL)
    list(APPEND values PACKAGE_ARCHITECTURE all PACKAGE_SHLIBDEPS OFF)
  endif()
  while(values)
    list(POP_FRONT values setting value)
    set(CPACK_DEBIAN_${key}_${setting} ${value} PARENT_SCOPE)
  endwhile()
  set(CPACK_DEBIAN_${key}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_DEPENDS "${ARG_DEPENDS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_RECOMMENDS "${ARG_RECOMMENDS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_SUGGESTS "${ARG_SUGGESTS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_CONTROL_EXTRA "${ARG_CONTROL}" PARENT_SCOPE)
  # Policy wants both in every package.
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/debian/changelog.gz ${CMAKE_CURRENT_SOURCE_DIR}/debian/copyright
          DESTINATION ${CMAKE_INSTALL_DOCDIR}/${name} COMPONENT ${component})
endfunction()

set(SHAPEDB_PACKAGER "The ShapeDB authors <shapedb@users.noreply.github.com>" CACHE STRING
    "Name and address that the packages give as their maintainer")
set(CPACK_PACKAGE_CONTACT "${SHAPEDB_PACKAGER}")
string(TIMESTAMP today "%a, %d %b %Y 00:00:00 +0000" UTC)
configure_file(debian/changelog.in debian/changelog @ONLY)
execute_process(COMMAND gzip -9nkf ${CMAKE_CURRENT_BINARY_DIR}/debian/changelog COMMAND_ERROR_IS_FATAL ANY)

set(what "ShapeDB finds 3D objects that look like a scan: scans are stored as point
clouds, and searched by shape, whatever their position and size.")
shapedb_package(server shapedb-server database "shape-retrieval database server for noisy 3D point clouds"
  "${what}\nThis package has the server, shapedbd, and its systemd service."
  DEPENDS "init-system-helpers (>= 1.54~), systemd | systemd-standalone-sysusers | systemd-sysusers"
  RECOMMENDS "shapedb-client" SUGGESTS "shapedb-doc, prometheus"
  CONTROL ${CMAKE_CURRENT_SOURCE_DIR}/debian/server/postinst ${CMAKE_CURRENT_SOURCE_DIR}/debian/server/prerm
          ${CMAKE_CURRENT_SOURCE_DIR}/debian/server/postrm ${CMAKE_CURRENT_SOURCE_DIR}/debian/server/conffiles)
shapedb_package(client shapedb-client science "command-line client of the ShapeDB shape-retrieval database"
  "${what}\nThis package has the command shapedb: it adds scans, searches, compares and\naligns them, and looks after servers."
  SUGGESTS "shapedb-server, shapedb-doc")
shapedb_package(development libshapedb-dev libdevel "C++ client library of the ShapeDB shape-retrieval database"
  "${what}\nThis package has the library, its headers, and the interface of the server as\nprotobuf files."
  DEPENDS "libgrpc++-dev, libprotobuf-dev, libssl-dev, libexpected-dev" SUGGESTS "cmake, shapedb-doc")
shapedb_package(python python3-shapedb python "Python client of the ShapeDB shape-retrieval database"
  "${what}\nThis package has the Python module shapedb."
  ALL DEPENDS "python3, python3-grpcio, python3-numpy, python3-protobuf" SUGGESTS "python3-matplotlib, python3-pandas, shapedb-server, shapedb-doc"
  CONTROL ${CMAKE_CURRENT_SOURCE_DIR}/debian/python/postinst ${CMAKE_CURRENT_SOURCE_DIR}/debian/python/prerm)
shapedb_package(docs shapedb-doc doc "documentation of the ShapeDB shape-retrieval database"
  "${what}\nThis package has its documentation." ALL)

include(CPack)
