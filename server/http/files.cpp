// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/files.h"

#include <algorithm>
#include <array>
#include <string>

#include <zlib.h>

namespace shapedb::http {
namespace {

/// The page may load and call what comes from this server, and nothing else; nobody may show it in a frame.
constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

void addPageFields(Response& response, const EmbeddedFile& file) {
    const std::pair<const char*, std::string_view> fields[] = {
        {"Content-Type", file.contentType},
        {"ETag", file.etag},
        {"Cache-Control", "no-cache"},  // may be kept, but has to be asked for
        {"Vary", "Accept-Encoding"},
        {"Content-Security-Policy", kContentPolicy},
        {"Cross-Origin-Opener-Policy", "same-origin"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Referrer-Policy", "no-referrer"},
        {"X-Content-Type-Options", "nosniff"},
        {"X-Frame-Options", "DENY"},
    };
    for (const auto& [name, value] : fields) response.fields.emplace_back(name, value);
}

/// Of a file of ours: damage is a mistake of the build, and gives an empty text.
std::string inflated(std::string_view gzip) {
    constexpr int kGzipWindow = 15 + 16;
    std::string text;
    z_stream stream{};
    if (::inflateInit2(&stream, kGzipWindow) != Z_OK) return text;
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
    stream.avail_in = static_cast<uInt>(gzip.size());
    std::array<char, 65'536> block{};
    int state = Z_OK;
    while (state == Z_OK) {
        stream.next_out = reinterpret_cast<Bytef*>(block.data());
        stream.avail_out = block.size();
        state = ::inflate(&stream, Z_NO_FLUSH);
        text.append(block.data(), block.size() - stream.avail_out);
    }
    ::inflateEnd(&stream);
    return state == Z_STREAM_END ? text : std::string();
}

bool takesGzip(const Head& head) {
    const std::string_view accepted = head.field("accept-encoding");
    const std::size_t at = accepted.find("gzip");
    return at != std::string_view::npos && accepted.substr(at + 4, 4) != ";q=0";
}

}  // namespace

Response fileResponse(const Head& head, const std::vector<EmbeddedFile>& files) {
    const std::string_view path = head.path() == "/" ? std::string_view("/index.html") : head.path();
    const auto file =
        std::find_if(files.begin(), files.end(), [&](const EmbeddedFile& one) { return one.path == path; });
    if (file == files.end()) {
        return responseOf(refuseWith(404, Code::kNotFound, "there is nothing at this path").value());
    }
    Response response;
    addPageFields(response, *file);
    if (head.field("if-none-match").find(file->etag) != std::string_view::npos) {
        response.status = 304;
    } else if (takesGzip(head)) {
        response.fields.emplace_back("Content-Encoding", "gzip");
        response.body = file->gzip;
    } else {
        response.body = inflated(file->gzip);
    }
    return response;
}

}  // namespace shapedb::http
