// SPDX-License-Identifier: GPL-3.0-or-later
// Takes requests apart as their bytes arrive: Boost.Beast's parser with our limits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <boost/beast/core/buffers_range.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>

#include "server/http/request.h"

namespace shapedb::http {

/// Hands the bytes of a body to a function as they are parsed (a Body of Boost.Beast).
struct BodySink {
    using value_type = std::function<void(std::string_view)>;

    class reader {
      public:
        template <bool isRequest, typename Fields>
        reader(boost::beast::http::header<isRequest, Fields>& /*head*/, value_type& sink) : sink_(sink) {}
        void init(const boost::optional<std::uint64_t>& /*length*/, boost::system::error_code& error) {
            error = {};
        }
        template <typename Buffers>
        std::size_t put(const Buffers& buffers, boost::system::error_code& error) {
            error = {};
            std::size_t bytes = 0;
            for (const boost::asio::const_buffer one : boost::beast::buffers_range_ref(buffers)) {
                if (sink_) sink_({static_cast<const char*>(one.data()), one.size()});
                bytes += one.size();
            }
            return bytes;
        }
        void finish(boost::system::error_code& error) { error = {}; }

      private:
        value_type& sink_;
    };
};

/// The requests of one connection, one after another. Keeps what it cannot use yet, and no more than a few
/// heads of it, if it gets more bytes only when it says that it has too few. Used by one thread.
class RequestParser {
  public:
    enum class Step {
        kSome,       ///< went on
        kTooLittle,  ///< needs more bytes
        kBad,        ///< no further step is possible: see `problem`
    };

    /// Before each request; bytes beyond the last one are its first.
    void begin();
    void add(std::string_view bytes) { waiting_.commit(copy(bytes)); }
    /// Bytes that are there and were not used.
    [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }
    void dropWaiting() { waiting_.consume(waiting_.size()); }

    /// Until `done`: the head, then at most one piece of the body.
    Step step();
    [[nodiscard]] bool headDone() const { return parser_->is_header_done(); }
    [[nodiscard]] bool done() const { return parser_->is_done(); }
    /// Whether the client wants to go on with another request; from `headDone` on.
    [[nodiscard]] bool keepAlive() const { return parser_->keep_alive(); }
    /// From `headDone` on.
    [[nodiscard]] Head head() const;
    /// Gets the body from now on, in the calls of `step`.
    void onBody(BodySink::value_type sink) { parser_->get().body() = std::move(sink); }

    /// After kBad.
    [[nodiscard]] Failure problem() const;

  private:
    std::size_t copy(std::string_view bytes);

    boost::beast::flat_buffer waiting_;
    std::optional<boost::beast::http::request_parser<BodySink>> parser_;
    boost::beast::error_code error_;
};

}  // namespace shapedb::http
