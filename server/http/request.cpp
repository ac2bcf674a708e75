// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/request.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include <arpa/inet.h>

#include "core/base/return_if_error.h"

namespace shapedb::http {
namespace {

constexpr std::size_t kMostTimeoutDigits = 10;

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return result;
}

/// Without port and brackets.
std::string hostOf(std::string_view authority) {
    if (!authority.empty() && authority.front() == '[') {
        const std::size_t end = authority.find(']');
        return end == std::string_view::npos ? std::string() : lower(authority.substr(1, end - 1));
    }
    return lower(authority.substr(0, authority.find(':')));
}

bool isAddress(const std::string& host) {
    in_addr v4{};
    in6_addr v6{};
    return ::inet_pton(AF_INET, host.c_str(), &v4) == 1 || ::inet_pton(AF_INET6, host.c_str(), &v6) == 1;
}

/// What gRPC takes as the value of a metadatum; it ends the process over anything else.
bool isPrintable(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c <= 0x7e; });
}

/// A page may only call the server that it came from. Browsers say where a page came from; other programs do
/// not.
OrFailure<void> checkOrigin(const Head& head) {
    const std::string_view origin = head.field("origin");
    if (origin.empty()) return {};
    const std::size_t scheme = origin.find("://");
    const bool same =
        scheme != std::string_view::npos && lower(origin.substr(scheme + 3)) == lower(head.field("host"));
    if (same) return {};
    return refuseWith(
        0, Code::kPermissionDenied,
        "a page of another site may not call this server: its Origin is not this server's Host");
}

OrFailure<void> checkEncoding(const Head& head, std::string_view field) {
    const std::string_view coding = head.field(field);
    if (coding.empty() || lower(coding) == "identity") return {};
    return refuseWith(
        0, Code::kUnimplemented,
        std::string(field) + " is not supported: only uncompressed bodies (identity) are supported");
}

OrFailure<void> readContentType(const Head& head, const Method& method, CallForm& form) {
    std::string type = lower(head.field("content-type"));
    type = type.substr(0, type.find(';'));
    while (!type.empty() && type.back() == ' ') type.pop_back();
    const std::string prefix = method.streams() ? "application/connect+" : "application/";
    form.enveloped = method.streams();
    form.json = type == prefix + "json";
    if (form.json || type == prefix + "proto") return {};
    return refuseWith(
        415, Code::kInvalidArgument,
        method.path.substr(1) + " takes Content-Type " + prefix + "json or " + prefix + "proto");
}

OrFailure<void> readTimeout(const Head& head, CallForm& form) {
    if (head.count("connect-timeout-ms") == 0) return {};
    const std::string_view text = head.field("connect-timeout-ms");
    std::uint64_t ms = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), ms);
    if (text.empty() || text.size() > kMostTimeoutDigits || error != std::errc() ||
        end != text.data() + text.size()) {
        return refuse(ErrorCode::kInvalidArgument, "Connect-Timeout-Ms is not a number of at most 10 digits");
    }
    form.timeout = std::chrono::milliseconds(ms);
    return {};
}

}  // namespace

std::string_view Head::field(std::string_view name) const {
    for (const auto& [key, value] : fields) {
        if (key == name) return value;
    }
    return {};
}

std::size_t Head::count(std::string_view name) const {
    return static_cast<std::size_t>(
        std::count_if(fields.begin(), fields.end(), [&](const auto& field) { return field.first == name; }));
}

std::string_view Head::path() const { return std::string_view(target).substr(0, target.find('?')); }

Hosts::Hosts(bool any, std::vector<std::string> names) : any_(any), names_(std::move(names)) {
    names_.emplace_back("localhost");
    for (std::string& name : names_) name = lower(name);
}

bool Hosts::allow(std::string_view authority) const {
    if (any_) return true;
    const std::string host = hostOf(authority);
    return isAddress(host) || std::find(names_.begin(), names_.end(), host) != names_.end();
}

OrFailure<void> checkHead(const Head& head, const Hosts& hosts) {
    if (head.version != 10 && head.version != 11) {
        return refuseWith(505, Code::kUnimplemented, "this server speaks HTTP/1.1");
    }
    if (head.target.empty() || head.target.front() != '/') {
        return refuseWith(400, Code::kInvalidArgument, "the request target is no path");
    }
    // A proxy in front must not read another length than we do (request smuggling).
    if (head.count("transfer-encoding") > 0 && lower(head.field("transfer-encoding")) != "chunked") {
        return refuseWith(501, Code::kUnimplemented, "the only Transfer-Encoding is chunked");
    }
    const std::string_view length = head.field("content-length");
    if (!std::all_of(length.begin(), length.end(), [](char c) { return c >= '0' && c <= '9'; })) {
        return refuseWith(400, Code::kInvalidArgument, "Content-Length is not a number");
    }
    for (const char* single : {"host", "content-length", "transfer-encoding", "content-type",
                               "content-encoding", "connect-content-encoding", "connect-timeout-ms",
                               "connect-protocol-version", "authorization", "origin"}) {
        if (head.count(single) > 1) {
            return refuseWith(400, Code::kInvalidArgument, std::string(single) + " comes more than once");
        }
    }
    if (head.count("host") == 0 && head.version == 11) {
        return refuseWith(400, Code::kInvalidArgument, "the request has no Host");
    }
    if (!hosts.allow(head.field("host"))) {
        return refuseWith(421, Code::kPermissionDenied,
                          "this server has not the name in Host: ask for it by its address, or tell it its "
                          "names with http.hosts");
    }
    return {};
}

const char* CallForm::contentType() const {
    if (enveloped) return json ? "application/connect+json" : "application/connect+proto";
    return json ? "application/json" : "application/proto";
}

OrFailure<CallForm> formOf(const Head& head, const Method& method) {
    CallForm form;
    RETURN_IF_ERROR(checkOrigin(head));
    RETURN_IF_ERROR(readContentType(head, method, form));
    for (const char* field : {"content-encoding", "connect-content-encoding"}) {
        RETURN_IF_ERROR(checkEncoding(head, field));
    }
    if (head.count("connect-protocol-version") > 0 && head.field("connect-protocol-version") != "1") {
        return refuse(ErrorCode::kInvalidArgument, "Connect-Protocol-Version is not 1");
    }
    RETURN_IF_ERROR(readTimeout(head, form));
    if (form.enveloped && head.version < 11) {
        return refuseWith(505, Code::kUnimplemented, "streams take HTTP/1.1");
    }
    if (!isPrintable(head.field("authorization"))) {
        return refuse(ErrorCode::kInvalidArgument, "Authorization has a character that no key has");
    }
    form.authorization = head.field("authorization");
    if (isPrintable(head.field("traceparent"))) form.traceparent = head.field("traceparent");
    return form;
}

}  // namespace shapedb::http
