// SPDX-License-Identifier: GPL-3.0-or-later
// One connection of an HTTP/1.1 client: its requests one after another, with a time limit on everything that
// it can make us wait for.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/http/byte_stream.h"
#include "server/http/connect_call.h"
#include "server/http/files.h"
#include "server/http/request_parser.h"
#include "server/net/transfer_pace.h"

namespace shapedb::http {

/// What all connections share. Thread-safe; outlives them.
struct ConnectionServices {
    CallServices calls;
    Hosts hosts;
    const std::vector<EmbeddedFile>& files;
    std::function<bool()> serving;  ///< for GET /healthz
    net::PaceLimits pace;
    std::chrono::seconds idle{};  ///< between two requests
    /// No further request is taken: each connection closes after its answer.
    std::atomic<bool> draining{false};
};

/// Lives as long as the network or its call need it. All of it on the socket's strand; `start`, `drain` and
/// `close` may be called from any thread.
class Connection final : public CallClient, public std::enable_shared_from_this<Connection> {
  public:
    /// `peer`: the client's address, as it goes into the log. `onGone` is called by the destructor.
    Connection(ConnectionServices& services, boost::asio::ip::tcp::socket socket,
               std::shared_ptr<boost::asio::ssl::context> tls, std::string peer,
               std::function<void()> onGone);
    ~Connection() override;

    void start();
    /// Closes it if it is between two requests.
    void drain();
    void close();

    void answer(Response response) override;
    void beginStream(Response response) override;
    void send(std::string bytes) override;
    void endStream(std::string bytes) override;
    void wantsMore() override;

  private:
    using Clock = std::chrono::steady_clock;
    enum class State {
        kHandshake,
        kIdle,    ///< nothing of a request has come
        kHead,    ///< a part of its head has
        kBody,    ///< its call takes the body
        kAnswer,  ///< nothing more is read of it
        kLinger,  ///< answered for the last time; the client may still be sending
        kClosed,
    };
    struct Piece {
        std::string bytes;
        bool tellCall = false;
    };

    template <typename Body>
    auto guarded(Body body);
    void nextRequest(std::chrono::milliseconds patience);
    void process();
    void processHead();
    void processBody();
    void route();
    void startCall(const Method& method, CallForm form, bool clientWaits);
    void read();
    void onRead(const boost::system::error_code& error, std::size_t bytes);
    void onEndOfClient();
    void enqueue(std::string bytes, bool tellCall = false);
    void writeNext();
    void onWritten(const boost::system::error_code& error, std::size_t bytes);
    void onAnswered();
    void linger();
    void tick();
    void look(Clock::time_point now);
    void closeNow();
    [[nodiscard]] bool decideToKeep();

    ConnectionServices& services_;
    boost::asio::ip::tcp::socket::executor_type executor_;
    ByteStream stream_;
    boost::asio::steady_timer timer_;
    const std::string peer_;
    const std::function<void()> onGone_;

    State state_ = State::kHandshake;
    Clock::time_point deadline_;           ///< of kHandshake, kIdle, kHead and kLinger
    std::array<char, 16'384> incoming_{};  ///< of the read under way
    RequestParser parser_;
    std::shared_ptr<ConnectCall> call_;
    bool reading_ = false;
    bool clientEnded_ = false;
    net::PaceMeter readPace_;

    std::deque<Piece> pieces_;
    std::size_t written_ = 0;  ///< of the first piece
    bool writing_ = false;
    net::PaceMeter writePace_;
    bool keep_ = false;      ///< the connection serves another request after this answer
    bool headOnly_ = false;  ///< HEAD
    bool answered_ = false;  ///< all pieces of the answer are there
};

}  // namespace shapedb::http
