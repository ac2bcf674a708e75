// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/byte_stream.h"

#include <utility>

#include <boost/asio/post.hpp>

namespace shapedb::http {

namespace asio = boost::asio;

ByteStream::ByteStream(Socket socket, std::shared_ptr<asio::ssl::context> tls)
    : socket_(std::move(socket)), context_(std::move(tls)) {
    if (context_) tls_.emplace(socket_, *context_);
}

void ByteStream::handshake(Done done) {
    if (!tls_) {
        asio::post(socket_.get_executor(), [done = std::move(done)] { done({}, 0); });
        return;
    }
    tls_->async_handshake(
        asio::ssl::stream_base::server,
        [done = std::move(done)](const boost::system::error_code& error) { done(error, 0); });
}

void ByteStream::readSome(asio::mutable_buffer buffer, Done done) {
    if (tls_) {
        tls_->async_read_some(buffer, std::move(done));
    } else {
        socket_.async_read_some(buffer, std::move(done));
    }
}

void ByteStream::writeSome(asio::const_buffer bytes, Done done) {
    if (tls_) {
        tls_->async_write_some(bytes, std::move(done));
    } else {
        socket_.async_write_some(bytes, std::move(done));
    }
}

void ByteStream::endWriting() {
    boost::system::error_code ignored;
    socket_.shutdown(Socket::shutdown_send, ignored);
}

void ByteStream::close() {
    boost::system::error_code ignored;
    socket_.close(ignored);
}

}  // namespace shapedb::http
