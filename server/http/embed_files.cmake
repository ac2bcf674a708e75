# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DFOLDER=page -DOUTPUT=embedded_files.cpp -P embed_files.cmake
# Writes every file below FOLDER, compressed by gzip, as one table (server/http/files.h). The same content gives the
# same bytes.
file(GLOB_RECURSE FILES RELATIVE ${FOLDER} ${FOLDER}/*)
list(SORT FILES)
set(type_html "text/html; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_json "application/json")
set(type_txt "text/plain; charset=utf-8")
set(type_svg "image/svg+xml")
set(type_png "image/png")
set(type_ico "image/x-icon")
set(type_wasm "application/wasm")
set(type_woff2 "font/woff2")
set(arrays "")
set(rows "")
set(number 0)
foreach(name IN LISTS FILES)
  string(REGEX MATCH "[^.]*$" ending "${name}")
  if(NOT DEFINED type_${ending} OR NOT name MATCHES "^[A-Za-z0-9_./-]+$")
    message(FATAL_ERROR "${FOLDER}/${name}: embed_files.cmake knows no content type for this ending, or the name has a "
                        "character that no path should have")
  endif()
  set(packed ${OUTPUT}.${number}.gz)
  execute_process(COMMAND gzip -9nc ${FOLDER}/${name} OUTPUT_FILE ${packed} COMMAND_ERROR_IS_FATAL ANY)
  file(READ ${packed} bytes HEX)
  file(SHA256 ${packed} digest)
  file(SIZE ${packed} size)
  file(REMOVE ${packed})
  string(SUBSTRING ${digest} 0 32 tag)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
  string(APPEND arrays "const unsigned char kFile${number}[] = {${bytes}};\n")
  string(APPEND rows "        {\"/${name}\", \"${type_${ending}}\", \"\\\"${tag}\\\"\",\n"
                     "         {reinterpret_cast<const char*>(kFile${number}), ${size}}},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${OUTPUT} "// Generated from ${FOLDER}; do not edit.
#include \"server/http/files.h\"

namespace shapedb::http {
namespace {

${arrays}
}  // namespace

const std::vector<EmbeddedFile>& embeddedFiles() {
    static const std::vector<EmbeddedFile> kFiles = {
${rows}    };
    return kFiles;
}

}  // namespace shapedb::http
")
