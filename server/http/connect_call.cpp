// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/connect_call.h"

#include <utility>

#include "common/protocol.h"
#include "core/base/return_if_error.h"
#include "server/rpc/limit_table.h"

namespace shapedb::http {
namespace {

constexpr std::size_t kMostMessageBytes = rpc::kMaxReceiveBytes;

}  // namespace

ConnectCall::ConnectCall(const CallServices& services, CallClient& client, const Method& method,
                         CallForm form, std::string peer, Post post)
    : services_(services),
      client_(&client),
      method_(method),
      form_(std::move(form)),
      peer_(std::move(peer)),
      post_(std::move(post)),
      envelopes_(kMostMessageBytes) {}

void ConnectCall::start() {
    // Whether the caller may call is found out before an upload arrives. A single message comes first: a
    // handler would hold a place of its kind while it waits for it.
    if (method_.clientStreams) startInner();
}

bool ConnectCall::wantsBody() const {
    if (client_ == nullptr || bodyEnded_) return false;
    // A call that has not begun has its one message, at most, and waits for the end.
    return !inner_ || (!writing_ && queue_.empty());
}

void ConnectCall::body(std::string_view bytes) {
    if (client_ == nullptr) return;
    if (const auto taken = take(bytes); !taken) return fail(taken.error());
    pump();
}

OrFailure<void> ConnectCall::takeSpace(std::size_t bytes) {
    if (!incoming_) incoming_ = std::make_unique<catalog::Budget::Share>(services_.transit);
    if (const auto taken = incoming_->take(bytes); !taken) {
        return refuse(taken.error().code, taken.error().message);
    }
    return {};
}

OrFailure<void> ConnectCall::take(std::string_view bytes) {
    RETURN_IF_ERROR(takeSpace(bytes.size()));
    if (!form_.enveloped) {
        if (unary_.size() + bytes.size() > kMostMessageBytes) {
            return refuseWith(0, Code::kResourceExhausted,
                              "the message has more than " + std::to_string(kMostMessageBytes) + " bytes");
        }
        unary_.append(bytes);
        return {};
    }
    std::vector<std::string> complete;
    RETURN_IF_ERROR(envelopes_.add(bytes, complete));
    for (std::string& message : complete) RETURN_IF_ERROR(enqueue(std::move(message)));
    return {};
}

OrFailure<void> ConnectCall::enqueue(std::string message) {
    if (++messages_ > 1 && !method_.clientStreams) {
        return refuse(ErrorCode::kMalformedStream, method_.path.substr(1) + " takes one message");
    }
    queue_.push_back({std::move(message), std::move(incoming_)});
    return {};
}

void ConnectCall::bodyEnd() {
    if (client_ == nullptr || bodyEnded_) return;
    bodyEnded_ = true;
    if (const auto finished = finishBody(); !finished) return fail(finished.error());
    if (!inner_) startInner();
    pump();
}

OrFailure<void> ConnectCall::finishBody() {
    if (!envelopes_.between()) {
        return refuse(ErrorCode::kMalformedStream, "the request ends within a message");
    }
    if (!form_.enveloped) RETURN_IF_ERROR(enqueue(std::exchange(unary_, {})));
    if (messages_ == 0 && !method_.clientStreams) {
        return refuse(ErrorCode::kMalformedStream,
                      method_.path.substr(1) + " takes one message: there is none");
    }
    return {};
}

void ConnectCall::startInner() {
    InnerCall::Events events;
    const auto self = shared_from_this();
    events.post = post_;
    events.onWritten = [self](bool good) { self->onWritten(good); };
    events.onMessage = [self](std::string message) { self->onMessage(std::move(message)); };
    events.onEnd = [self](const Ending& ending) { self->onEnd(ending); };
    inner_ = services_.calls.start(method_, form_, peer_, std::move(events));
    // Always under way, but while an answer is being sent: it also tells of the end.
    inner_->read();
}

void ConnectCall::pump() {
    if (!inner_ || writing_ || client_ == nullptr) return;
    if (queue_.empty()) {
        if (bodyEnded_ && !std::exchange(halfClosed_, true)) inner_->writesDone();
        return;
    }
    std::string message = std::move(queue_.front().bytes);
    queue_.pop_front();
    if (form_.json) {
        auto converted = services_.methods.requestFromJson(method_, message);
        if (!converted) return fail(converted.error());
        message = std::move(*converted);
    }
    writing_ = true;
    inner_->write(std::move(message));
}

void ConnectCall::onWritten(bool good) {
    writing_ = false;
    // Otherwise the call is over, and the read tells how.
    if (good) pump();
    if (wantsBody()) client_->wantsMore();
}

OrFailure<std::string> ConnectCall::encoded(std::string message) {
    outgoing_ = std::make_unique<catalog::Budget::Share>(services_.transit);
    const auto takeRoom = [&](std::size_t bytes) -> OrFailure<void> {
        if (const auto taken = outgoing_->take(bytes); !taken) {
            return refuse(taken.error().code, taken.error().message);
        }
        return {};
    };
    RETURN_IF_ERROR(takeRoom(message.size()));
    if (!form_.json) return message;
    auto json = services_.methods.responseToJson(method_, message);
    RETURN_IF_ERROR(json);
    RETURN_IF_ERROR(takeRoom(json->size()));
    return json;
}

void ConnectCall::onMessage(std::string message) {
    if (client_ == nullptr) return;
    if (!form_.enveloped) {
        answers_.push_back(std::move(message));
        return inner_->read();
    }
    auto bytes = encoded(std::move(message));
    if (!bytes) return fail(bytes.error());
    beginStream();
    client_->send(inEnvelope(kPlainMessage, *bytes));
}

void ConnectCall::sent() {
    outgoing_.reset();
    if (client_ != nullptr && inner_) inner_->read();
}

void ConnectCall::onEnd(const Ending& ending) {
    inner_.reset();
    if (client_ == nullptr) return;
    if (!ending.good) return fail(ending.failure, ending.trailers);
    if (form_.enveloped) {
        beginStream();
        const std::string last = inEnvelope(kEndOfStream, endOfStreamJson(nullptr, ending.trailers));
        std::exchange(client_, nullptr)->endStream(last);
        return;
    }
    if (answers_.size() != 1) {
        Failure failure;
        failure.code = Code::kInternal;
        failure.message = "the call has no answer";
        return fail(failure);
    }
    answer(answers_.front(), ending.trailers);
}

void ConnectCall::answer(const std::string& message, const Trailers& trailers) {
    auto body = encoded(message);
    if (!body) return fail(body.error());
    Response response;
    response.fields.emplace_back("Content-Type", form_.contentType());
    addApiFields(response);
    addTrailers(response, trailers);
    response.body = std::move(*body);
    std::exchange(client_, nullptr)->answer(std::move(response));
}

void ConnectCall::beginStream() {
    if (std::exchange(streamBegun_, true)) return;
    Response response;
    response.fields.emplace_back("Content-Type", form_.contentType());
    addApiFields(response);
    client_->beginStream(std::move(response));
}

void ConnectCall::fail(const Failure& failure, const Trailers& trailers) {
    if (client_ == nullptr) return;
    if (form_.enveloped) {
        beginStream();
        const std::string last = inEnvelope(kEndOfStream, endOfStreamJson(&failure, trailers));
        std::exchange(client_, nullptr)->endStream(last);
    } else {
        std::exchange(client_, nullptr)->answer(responseOf(failure, trailers));
    }
    leave();
}

void ConnectCall::abandon() {
    client_ = nullptr;
    leave();
}

void ConnectCall::cutOff(const Error& why) { fail(refuse(why.code, kCutOffPrefix + why.message).value()); }

void ConnectCall::leave() {
    if (inner_) inner_->cancel();
    queue_.clear();
    unary_.clear();
    incoming_.reset();
    answers_.clear();
}

}  // namespace shapedb::http
