# SPDX-License-Identifier: GPL-3.0-or-later
# Removes precompiled headers that contain generated messages: g++ would read the old one while it makes the new one, and
# new fields would not be seen.
#   cmake -D FOLDER=build -P drop_precompiled_messages.cmake
file(GLOB_RECURSE headers ${FOLDER}/*/cmake_pch.hxx)
foreach(header ${headers})
  file(STRINGS ${header} messages REGEX "\\.pb\\.h")
  if(messages)
    file(REMOVE ${header}.gch)
  endif()
endforeach()
