// SPDX-License-Identifier: GPL-3.0-or-later
// An answer before it is written.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/http/failure.h"

namespace shapedb::http {

struct Response {
    unsigned status = 200;
    std::vector<std::pair<std::string, std::string>> fields;
    std::string body;
    bool last = false;  ///< the connection takes no further request
};

/// The answer to a request or unary call that failed: JSON, with `trailers` as fields.
[[nodiscard]] Response responseOf(const Failure& failure, const Trailers& trailers = {});
/// The answer to GET /healthz: 200 or 503.
[[nodiscard]] Response healthResponse(bool serving);
/// Adds the trailers of a unary answer, as the Connect protocol has them: before the body, each name after
/// "trailer-".
void addTrailers(Response& response, const Trailers& trailers);
/// The head as it is written: "HTTP/1.1 200 OK" to the empty line, with the date. `rest`: fields about the
/// connection and the body's length.
[[nodiscard]] std::string headText(const Response& response, const std::vector<std::string>& rest);
/// Adds what forbids browsers to guess, keep and embed.
void addApiFields(Response& response);

}  // namespace shapedb::http
