// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/connection.h"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>

#include "server/rpc/limit_table.h"

namespace shapedb::http {
namespace {

namespace asio = boost::asio;

/// How much is kept of what a client sends before it has its answer; its end is noticed within that.
constexpr std::size_t kMostAhead = 16'384;
constexpr std::size_t kWriteBytes = 65'536;
constexpr std::chrono::milliseconds kLook{500};
constexpr std::chrono::milliseconds kLingerTime{2'000};

std::string inChunk(std::string_view bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    std::string size;
    for (std::size_t left = bytes.size(); left > 0; left >>= 4) size.insert(size.begin(), kDigits[left & 15]);
    std::string chunk;
    chunk.reserve(size.size() + bytes.size() + 4);
    return chunk.append(size).append("\r\n").append(bytes).append("\r\n");
}

constexpr const char* kLastChunk = "0\r\n\r\n";

}  // namespace

/// Keeps the connection alive for the handler. What it throws, a lack of memory, ends this connection and no
/// other.
template <typename Body>
auto Connection::guarded(Body body) {
    return [self = shared_from_this(), body = std::move(body)](const auto&... arguments) mutable {
        try {
            body(arguments...);
        } catch (...) {
            self->closeNow();
        }
    };
}

Connection::Connection(ConnectionServices& services, asio::ip::tcp::socket socket,
                       std::shared_ptr<asio::ssl::context> tls, std::string peer,
                       std::function<void()> onGone)
    : services_(services),
      executor_(socket.get_executor()),
      stream_(std::move(socket), std::move(tls)),
      timer_(executor_),
      peer_(std::move(peer)),
      onGone_(std::move(onGone)) {}

Connection::~Connection() { onGone_(); }

void Connection::start() {
    asio::post(executor_, guarded([this] {
                   deadline_ = Clock::now() + rpc::kHandshakeTime;
                   tick();
                   stream_.handshake(guarded([this](const boost::system::error_code& error, std::size_t) {
                       if (state_ == State::kClosed) return;
                       if (error) return closeNow();
                       nextRequest(rpc::kHandshakeTime);
                   }));
               }));
}

void Connection::close() {
    asio::post(executor_, guarded([this] { closeNow(); }));
}

void Connection::drain() {
    asio::post(executor_, guarded([this] { look(Clock::now()); }));
}

void Connection::closeNow() {
    if (std::exchange(state_, State::kClosed) == State::kClosed) return;
    timer_.cancel();
    stream_.close();
    if (const auto call = std::exchange(call_, nullptr)) call->abandon();
}

void Connection::nextRequest(std::chrono::milliseconds patience) {
    call_.reset();
    if (services_.draining) return linger();
    parser_.begin();
    readPace_ = {};
    writePace_ = {};
    answered_ = false;
    headOnly_ = false;
    state_ = State::kIdle;
    deadline_ = Clock::now() + patience;
    process();
}

void Connection::process() {
    if (state_ == State::kIdle && parser_.waiting() > 0) {
        state_ = State::kHead;
        deadline_ = Clock::now() + rpc::kHandshakeTime;
    }
    if (state_ == State::kHead) processHead();
    if (state_ == State::kBody) processBody();
    if (state_ == State::kLinger) parser_.dropWaiting();
    read();
}

void Connection::processHead() {
    while (!parser_.headDone()) {
        const RequestParser::Step step = parser_.step();
        if (step == RequestParser::Step::kTooLittle) return;
        if (step == RequestParser::Step::kBad) return answer(responseOf(parser_.problem()));
    }
    state_ = State::kAnswer;
    route();
}

void Connection::processBody() {
    const auto call = call_;
    while (state_ == State::kBody && !parser_.done() && call->wantsBody()) {
        const RequestParser::Step step = parser_.step();
        if (step == RequestParser::Step::kTooLittle) return;
        if (step == RequestParser::Step::kBad)
            return call->cutOff({ErrorCode::kMalformedStream, parser_.problem().message});
    }
    if (state_ != State::kBody || !parser_.done()) return;
    state_ = State::kAnswer;
    call->bodyEnd();
}

void Connection::route() {
    const Head asked = parser_.head();
    headOnly_ = asked.method == "HEAD";
    if (const auto good = checkHead(asked, services_.hosts); !good) {
        Response refused = responseOf(good.error());
        refused.last = true;  // where the request ends may be in doubt
        return answer(std::move(refused));
    }
    const bool reads = asked.method == "GET" || headOnly_;
    const bool call = Methods::isCall(asked.path());
    if (call ? asked.method != "POST" : !reads) {
        Response refused = responseOf(
            refuseWith(405, Code::kUnimplemented, "this path does not take the method " + asked.method)
                .value());
        refused.fields.emplace_back("Allow", call ? "POST" : "GET, HEAD");
        return answer(std::move(refused));
    }
    if (!call) {
        return answer(asked.path() == "/healthz" ? healthResponse(services_.serving())
                                                 : fileResponse(asked, services_.files));
    }
    const Method* method = services_.calls.methods.find(asked.path());
    if (method == nullptr) {
        return answer(responseOf(refuseWith(404, Code::kUnimplemented, "there is no such call").value()));
    }
    auto form = formOf(asked, *method);
    if (!form) return answer(responseOf(form.error()));
    const bool waits = asked.version == 11 && asked.field("expect") == "100-continue";
    startCall(*method, std::move(*form), waits);
}

void Connection::startCall(const Method& method, CallForm form, bool clientWaits) {
    const auto post = [executor = executor_, weak = weak_from_this()](std::function<void()> what) {
        asio::post(executor, [weak, what = std::move(what)] {
            try {
                what();
            } catch (...) {
                if (const auto self = weak.lock()) self->closeNow();
            }
        });
    };
    call_ = std::make_shared<ConnectCall>(services_.calls, *this, method, std::move(form), peer_, post);
    parser_.onBody([call = call_.get()](std::string_view bytes) { call->body(bytes); });
    state_ = State::kBody;
    if (clientWaits && !parser_.done()) enqueue("HTTP/1.1 100 Continue\r\n\r\n");
    const auto call = call_;
    call->start();
    if (state_ == State::kBody && parser_.done()) processBody();
}

void Connection::read() {
    if (reading_ || clientEnded_ || state_ == State::kClosed) return;
    if (state_ == State::kBody && (parser_.done() || !call_->wantsBody())) return;
    if (state_ == State::kAnswer && parser_.waiting() >= kMostAhead) return;
    reading_ = true;
    if (state_ == State::kBody) readPace_.begin(Clock::now());
    stream_.readSome(asio::buffer(incoming_), guarded([this](const boost::system::error_code& error,
                                                             std::size_t bytes) { onRead(error, bytes); }));
}

void Connection::onRead(const boost::system::error_code& error, std::size_t bytes) {
    reading_ = false;
    if (state_ == State::kClosed) return;
    readPace_.end(Clock::now(), bytes);
    if (error) return onEndOfClient();
    parser_.add({incoming_.data(), bytes});
    process();
}

void Connection::onEndOfClient() {
    // A client that has stopped sending counts as gone, even if it might still read: its call is cancelled.
    // What is there already is sent.
    if (!answered_ || pieces_.empty()) return closeNow();
    keep_ = false;
    clientEnded_ = true;
}

void Connection::wantsMore() { process(); }

bool Connection::decideToKeep() {
    return parser_.headDone() && parser_.done() && parser_.keepAlive() && !services_.draining;
}

void Connection::answer(Response response) {
    keep_ = decideToKeep() && !response.last;
    const bool empty = response.status == 304;
    std::vector<std::string> rest;
    if (!empty) rest.push_back("Content-Length: " + std::to_string(response.body.size()));
    rest.emplace_back(keep_ ? "Connection: keep-alive" : "Connection: close");
    state_ = State::kAnswer;
    answered_ = true;
    enqueue(headText(response, rest));
    if (!empty && !headOnly_ && !response.body.empty()) enqueue(std::move(response.body));
}

void Connection::beginStream(Response response) {
    keep_ = decideToKeep();
    enqueue(headText(response,
                     {"Transfer-Encoding: chunked", keep_ ? "Connection: keep-alive" : "Connection: close"}));
}

void Connection::send(std::string bytes) { enqueue(inChunk(bytes), true); }

void Connection::endStream(std::string bytes) {
    if (!parser_.done()) keep_ = false;
    state_ = State::kAnswer;
    answered_ = true;
    enqueue(inChunk(bytes) + kLastChunk);
}

void Connection::enqueue(std::string bytes, bool tellCall) {
    if (state_ == State::kClosed) return;
    pieces_.push_back({std::move(bytes), tellCall});
    writeNext();
}

void Connection::writeNext() {
    if (writing_ || pieces_.empty()) return;
    writing_ = true;
    writePace_.begin(Clock::now());
    const std::string& bytes = pieces_.front().bytes;
    stream_.writeSome(asio::buffer(bytes.data() + written_, std::min(bytes.size() - written_, kWriteBytes)),
                      guarded([this](const boost::system::error_code& error, std::size_t count) {
                          onWritten(error, count);
                      }));
}

void Connection::onWritten(const boost::system::error_code& error, std::size_t bytes) {
    writing_ = false;
    if (state_ == State::kClosed) return;
    writePace_.end(Clock::now(), bytes);
    if (error) return closeNow();
    written_ += bytes;
    if (written_ == pieces_.front().bytes.size()) {
        const bool tellCall = pieces_.front().tellCall;
        pieces_.pop_front();
        written_ = 0;
        if (tellCall && call_) call_->sent();
    }
    if (!pieces_.empty()) return writeNext();
    if (answered_) onAnswered();
}

void Connection::onAnswered() {
    if (keep_) {
        nextRequest(services_.idle);
    } else {
        linger();
    }
}

void Connection::linger() {
    // Closed at once, a socket with unread bytes would take the answer along.
    state_ = State::kLinger;
    deadline_ = Clock::now() + kLingerTime;
    if (clientEnded_) return closeNow();
    stream_.endWriting();
    process();
}

void Connection::tick() {
    timer_.expires_after(kLook);
    timer_.async_wait(guarded([this](const boost::system::error_code& error) {
        if (error || state_ == State::kClosed) return;
        look(Clock::now());
        if (state_ != State::kClosed) tick();
    }));
}

void Connection::look(Clock::time_point now) {
    const bool limited = state_ == State::kHandshake || state_ == State::kIdle || state_ == State::kHead ||
                         state_ == State::kLinger;
    if (state_ == State::kIdle && services_.draining) return closeNow();
    if (limited && now >= deadline_) {
        if (state_ != State::kHead) return closeNow();
        state_ = State::kAnswer;
        return answer(responseOf(
            refuseWith(408, Code::kDeadlineExceeded, "the head of the request took too long").value()));
    }
    if (writing_ && writePace_.pace(services_.pace, now) != net::Pace::kGood) return closeNow();
    if (state_ != State::kBody || !call_->waitsForBodyAlone()) return;
    const net::Pace pace = readPace_.pace(services_.pace, now);
    if (pace != net::Pace::kGood) {
        call_->cutOff({ErrorCode::kDeadlineExceeded, net::reasonOf(pace, services_.pace)});
    }
}

}  // namespace shapedb::http
