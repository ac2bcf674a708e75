// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/inner_call.h"

#include <charconv>
#include <optional>

#include <grpcpp/channel.h>
#include <grpcpp/support/slice.h>

#include "common/protocol.h"
#include "server/rpc/status.h"

namespace shapedb::http {
namespace {

grpc::ByteBuffer bufferOf(const std::string& bytes) {
    const grpc::Slice slice(bytes.data(), bytes.size());
    return {&slice, 1};
}

std::string bytesOf(const grpc::ByteBuffer& buffer) {
    std::vector<grpc::Slice> slices;
    std::string bytes;
    if (!buffer.Dump(&slices).ok()) return bytes;
    bytes.reserve(buffer.Length());
    for (const grpc::Slice& slice : slices)
        bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    return bytes;
}

Trailers trailersOf(const grpc::ClientContext& context) {
    Trailers trailers;
    for (const auto& [key, value] : context.GetServerTrailingMetadata()) {
        trailers.emplace(std::string(key.data(), key.size()), std::string(value.data(), value.size()));
    }
    return trailers;
}

std::optional<std::chrono::milliseconds> retryAfter(const Trailers& trailers) {
    const auto found = trailers.find(rpc::kRetryKey);
    if (found == trailers.end()) return std::nullopt;
    const std::string& text = found->second;
    std::int64_t ms = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), ms);
    if (error != std::errc() || end != text.data() + text.size() || ms < 0) return std::nullopt;
    return std::chrono::milliseconds(ms);
}

Ending endingOf(const grpc::Status& status, const grpc::ClientContext& context) {
    Ending ending;
    ending.good = status.ok();
    ending.trailers = trailersOf(context);
    if (ending.good) return ending;
    ending.failure.code = codeOfNumber(status.error_code());
    ending.failure.message = status.error_message();
    const auto name = ending.trailers.find(rpc::kErrorNameKey);
    if (name != ending.trailers.end()) {
        ending.failure.name = name->second;
    } else if (ending.failure.message.rfind(kCutOffPrefix, 0) == 0) {
        ending.failure.name = rpc::nameOfCutOff(status.error_code());
    }
    ending.failure.retryAfter = retryAfter(ending.trailers);
    return ending;
}

}  // namespace

InnerCall::InnerCall(InnerCalls& calls, Events events) : calls_(calls), events_(std::move(events)) {
    calls_.count(1);
}

InnerCall::~InnerCall() = default;

void InnerCall::write(std::string message) {
    if (over_) return;
    outgoing_ = bufferOf(message);
    StartWrite(&outgoing_);
}

void InnerCall::writesDone() {
    if (!over_) StartWritesDone();
}

void InnerCall::read() {
    if (!over_) StartRead(&incoming_);
}

void InnerCall::cancel() {
    if (over_) return;
    context_.TryCancel();
    noMoreOperations();
}

void InnerCall::noMoreOperations() {
    if (std::exchange(over_, true)) return;
    // Without the hold gRPC reports the end as soon as what was started has returned.
    RemoveHold();
}

void InnerCall::OnWriteDone(bool good) {
    outgoing_.Clear();
    events_.post([self = self_, good] {
        if (!self->over_) self->events_.onWritten(good);
    });
}

void InnerCall::OnReadDone(bool good) {
    events_.post([self = self_, good] {
        if (self->over_) return;
        if (!good) return self->noMoreOperations();
        std::string message = bytesOf(self->incoming_);
        self->incoming_.Clear();
        self->events_.onMessage(std::move(message));
    });
}

void InnerCall::OnDone(const grpc::Status& status) {
    // gRPC's in-process transport (1.51) keeps both sides of a call in memory for good if it was over before
    // all of the request was written, as when a caller is refused. A cancelled one it lets go; the status is
    // known by now.
    context_.TryCancel();
    // The last that gRPC knows of this object, which may be gone as soon as this is posted.
    InnerCalls& calls = calls_;
    const auto post = events_.post;
    post([self = std::move(self_), status] {
        self->over_ = true;
        const auto onEnd = std::move(self->events_.onEnd);
        self->events_ = {};
        onEnd(endingOf(status, self->context_));
    });
    calls.count(-1);
}

InnerCalls::InnerCalls(rpc::Inside inside) : inside_(std::move(inside)), stub_(inside_.channel) {}

std::shared_ptr<InnerCall> InnerCalls::start(const Method& method, const CallForm& form,
                                             const std::string& peer, InnerCall::Events events) {
    auto call = std::make_shared<InnerCall>(*this, std::move(events));
    call->self_ = call;
    grpc::ClientContext& context = call->context_;
    context.AddMetadata(rpc::kInsideKey, inside_.secret);
    context.AddMetadata(rpc::kPeerKey, peer);
    if (!form.authorization.empty()) context.AddMetadata("authorization", form.authorization);
    if (!form.traceparent.empty()) context.AddMetadata("traceparent", form.traceparent);
    if (form.timeout) context.set_deadline(std::chrono::system_clock::now() + *form.timeout);
    stub_.PrepareBidiStreamingCall(&context, method.path, {}, call.get());
    // Operations are started from outside gRPC's callbacks.
    call->AddHold();
    call->StartCall();
    return call;
}

void InnerCalls::count(int change) {
    const std::lock_guard<std::mutex> lock(mutex_);
    running_ += change;
    if (running_ == 0) changed_.notify_all();
}

void InnerCalls::waitUntilNone() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return running_ == 0; });
}

}  // namespace shapedb::http
