// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/response.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <ostream>  // which Boost 1.74 leaves out
#include <string_view>

#include <boost/beast/http/status.hpp>

namespace shapedb::http {
namespace {

/// Values of binary metadata are no text; ours have none.
bool isText(const std::string& key) {
    constexpr std::string_view kBinary = "-bin";
    return key.size() < kBinary.size() ||
           key.compare(key.size() - kBinary.size(), kBinary.size(), kBinary) != 0;
}

/// No byte that would end a field.
bool fitsField(const std::string& value) {
    return std::none_of(value.begin(), value.end(),
                        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

std::string reasonPhrase(unsigned status) {
    // Not in any standard, but what the Connect protocol gives a cancelled call.
    if (status == 499) return "Client Closed Request";
    const auto text = boost::beast::http::obsolete_reason(boost::beast::http::int_to_status(status));
    return {text.data(), text.size()};
}

std::string date() {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    std::array<char, 40> text{};
    const std::size_t size = std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &utc);
    return {text.data(), size};
}

}  // namespace

std::string headText(const Response& response, const std::vector<std::string>& rest) {
    std::string text =
        "HTTP/1.1 " + std::to_string(response.status) + " " + reasonPhrase(response.status) + "\r\n";
    text += "Date: " + date() + "\r\n";
    for (const auto& [name, value] : response.fields) {
        if (fitsField(value)) text += name + ": " + value + "\r\n";
    }
    for (const std::string& field : rest) text += field + "\r\n";
    return text + "\r\n";
}

void addTrailers(Response& response, const Trailers& trailers) {
    for (const auto& [key, value] : trailers) {
        if (isText(key)) response.fields.emplace_back("trailer-" + key, value);
    }
}

void addApiFields(Response& response) {
    response.fields.emplace_back("Cache-Control", "no-store");
    response.fields.emplace_back("X-Content-Type-Options", "nosniff");
}

Response healthResponse(bool serving) {
    Response response;
    response.status = serving ? 200 : 503;
    response.fields.emplace_back("Content-Type", "application/json");
    addApiFields(response);
    response.body = serving ? "{\"status\":\"SERVING\"}\n" : "{\"status\":\"NOT_SERVING\"}\n";
    return response;
}

Response responseOf(const Failure& failure, const Trailers& trailers) {
    Response response;
    response.status = failure.httpStatus();
    response.fields.emplace_back("Content-Type", "application/json");
    addApiFields(response);
    if (response.status == 401) response.fields.emplace_back("WWW-Authenticate", "Bearer");
    if (failure.retryAfter) {
        const auto seconds = std::chrono::ceil<std::chrono::seconds>(*failure.retryAfter).count();
        response.fields.emplace_back("Retry-After", std::to_string(std::max<long>(seconds, 1)));
    }
    addTrailers(response, trailers);
    response.body = failureJson(failure);
    return response;
}

}  // namespace shapedb::http
