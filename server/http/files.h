// SPDX-License-Identifier: GPL-3.0-or-later
// The files of the web page, compiled into the server.
#pragma once

#include <string_view>
#include <vector>

#include "server/http/request.h"
#include "server/http/response.h"

namespace shapedb::http {

/// One of the folder that CMake is given as SHAPEDB_PAGE. `/` is `/index.html`.
struct EmbeddedFile {
    std::string_view path;         ///< "/index.html"
    std::string_view contentType;  ///< by its ending
    std::string_view etag;         ///< in quotes; changes with the content
    std::string_view gzip;         ///< the content, compressed
};

/// Generated; static storage.
[[nodiscard]] const std::vector<EmbeddedFile>& embeddedFiles();

/// The answer to GET or HEAD of a path: a file, 304 if the client has it, or 404. Compressed, unless the
/// client does not take that.
[[nodiscard]] Response fileResponse(const Head& head, const std::vector<EmbeddedFile>& files);

}  // namespace shapedb::http
