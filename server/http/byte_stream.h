// SPDX-License-Identifier: GPL-3.0-or-later
// The bytes of one connection, through TLS or plain.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/system/error_code.hpp>

namespace shapedb::http {

/// One read and one write at a time; completion handlers run on the socket's executor, never before these
/// functions return. All functions are called there.
class ByteStream {
  public:
    using Done = std::function<void(const boost::system::error_code& error, std::size_t bytes)>;

    /// `tls` null: plain. `socket` has a strand of its own.
    ByteStream(boost::asio::ip::tcp::socket socket, std::shared_ptr<boost::asio::ssl::context> tls);

    /// Before anything else. Without TLS it is done at once.
    void handshake(Done done);
    void readSome(boost::asio::mutable_buffer buffer, Done done);
    void writeSome(boost::asio::const_buffer bytes, Done done);
    /// The other side reads the end after what was written.
    void endWriting();
    /// Reads and writes in progress end with an error. Idempotent.
    void close();

  private:
    using Socket = boost::asio::ip::tcp::socket;

    Socket socket_;
    std::shared_ptr<boost::asio::ssl::context> context_;
    std::optional<boost::asio::ssl::stream<Socket&>> tls_;
};

}  // namespace shapedb::http
