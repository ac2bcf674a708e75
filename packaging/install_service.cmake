# SPDX-License-Identifier: GPL-3.0-or-later
# Run by the installation of the server: what names places of the system, known only now. Expects SOURCE and BUILD
# (folders of the project). Below /usr the configuration is /etc/shapedb/shapedbd.toml, else PREFIX/etc/shapedb/shapedbd.toml;
# one that exists is left alone.
set(BINDIR ${CMAKE_INSTALL_PREFIX}/bin)
set(ETC ${CMAKE_INSTALL_PREFIX}/etc/shapedb)
if(CMAKE_INSTALL_PREFIX MATCHES "^/usr/?$")
  set(ETC /etc/shapedb)
endif()
set(CONFIG ${ETC}/shapedbd.toml)
set(made ${BUILD}/packaging/service)

configure_file(${SOURCE}/packaging/shapedbd.service.in ${made}/shapedbd.service @ONLY)
configure_file(${SOURCE}/packaging/shapedb.sysusers ${made}/shapedb.conf COPYONLY)
# That of the documentation, but for the place of the data.
file(READ ${SOURCE}/server/config/shapedbd.example.toml example)
string(REPLACE "data = \"shapedb-data\"" "data = \"/var/lib/shapedb\"" config "${example}")
if(config STREQUAL example)
  message(FATAL_ERROR "shapedbd.example.toml does not say where the data is")
endif()
string(REPLACE "shapedbd --config shapedbd.toml" "systemctl restart shapedbd" config "${config}")
file(WRITE ${made}/shapedbd.toml "${config}")

file(INSTALL ${made}/shapedbd.service DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/systemd/system)
file(INSTALL ${made}/shapedb.conf DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/sysusers.d)
if(NOT EXISTS $ENV{DESTDIR}${CONFIG})
  file(INSTALL ${made}/shapedbd.toml DESTINATION ${ETC})
endif()
