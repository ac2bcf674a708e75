// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/request_parser.h"

#include <cctype>
#include <limits>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>

namespace shapedb::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;

constexpr std::size_t kMostHeadBytes = 16'384;
/// The head of a chunk, with its extensions, or the fields after the last.
constexpr std::size_t kMostChunkHeadBytes = 16'384;

}  // namespace

void RequestParser::begin() {
    error_ = {};
    parser_.emplace();
    parser_->header_limit(kMostHeadBytes);
    // Of uploads without end; a call limits its messages. "None" would mean 0 in Beast of Boost 1.74.
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());
}

std::size_t RequestParser::copy(std::string_view bytes) {
    return asio::buffer_copy(waiting_.prepare(bytes.size()), asio::buffer(bytes.data(), bytes.size()));
}

RequestParser::Step RequestParser::step() {
    if (waiting_.size() == 0) return Step::kTooLittle;
    error_ = {};
    const std::size_t used = parser_->put(waiting_.data(), error_);
    waiting_.consume(used);
    if (!error_ || (error_ == beast::http::error::need_more && used > 0)) return Step::kSome;
    if (error_ != beast::http::error::need_more) return Step::kBad;
    // Beast limits heads of requests only.
    const bool endless = parser_->is_header_done() && waiting_.size() >= kMostChunkHeadBytes;
    if (!endless) return Step::kTooLittle;
    error_ = beast::http::error::bad_chunk;
    return Step::kBad;
}

Head RequestParser::head() const {
    const auto& message = parser_->get();
    Head head;
    head.method = std::string(message.method_string());
    head.target = std::string(message.target());
    head.version = static_cast<int>(message.version());
    for (const auto& field : message) {
        std::string name(field.name_string());
        for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        head.fields.emplace_back(std::move(name), std::string(field.value()));
    }
    return head;
}

Failure RequestParser::problem() const {
    const unsigned status = error_ == beast::http::error::header_limit ? 431 : 400;
    return refuseWith(status, Code::kInvalidArgument, "this is not HTTP/1.1: " + error_.message()).value();
}

}  // namespace shapedb::http
