// SPDX-License-Identifier: GPL-3.0-or-later
// One gRPC call around its handler: who may make it (security::Authorization), the rules of
// catalog::CallFrame, the client's cancellation and deadline, one log line; no exception leaves it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include "core/base/error.h"
#include "core/base/return_if_error.h"
#include "core/base/run_context.h"
#include "server/catalog/call_frame.h"
#include "server/rpc/services.h"
#include "server/security/authorization.h"
#include "server/security/operation.h"
#include "shapedb/v1/shape_service.pb.h"

namespace shapedb::rpc {

namespace operations = security::operations;

/// One call while it runs. Used by its own thread only.
class Call {
  public:
    Call(const Services& services, grpc::ServerContext& context, const security::Operation& operation);
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    /// First of all. Errors: those of Authorization::begin and CallFrame::admit.
    [[nodiscard]] Result<void> begin();
    [[nodiscard]] catalog::CallFrame& frame() { return frame_; }
    [[nodiscard]] const security::Authorization& authorization() const { return authorization_; }

    /// Follows the client's cancellation and deadline.
    [[nodiscard]] const RunContext& run() const { return run_; }

    /// Reads one message of a stream. False at its end or when the client has gone. A client that makes
    /// this block for limits.stall_seconds, or that is slower than limits.min_bytes_per_second in the
    /// long run, is cut off.
    template <typename Reader, typename Message>
    bool read(Reader& reader, Message* message) {
        cancellation_.beginTransfer();
        const bool good = reader.Read(message);
        cancellation_.endTransfer(good ? sizeOf(*message) : 0);
        return good;
    }
    /// Errors: kCancelled (the client has gone or was cut off as above).
    template <typename Writer, typename Message>
    Result<void> write(Writer& writer, const Message& message) {
        cancellation_.beginTransfer();
        const bool good = writer.Write(message);
        cancellation_.endTransfer(sizeOf(message));
        if (good) return {};
        return fail(ErrorCode::kCancelled, "the client has gone");
    }

    /// Asks gRPC directly; the flag in `run()` follows a moment later.
    [[nodiscard]] bool clientGone() const { return context_.IsCancelled(); }

    /// Before anything of a collection (the default one for an empty name) is read or changed: whether the
    /// caller may; noted for the log. Errors: kPermissionDenied.
    /// Returns the name of the collection itself, which an alias stands for at this moment: look nothing up
    /// by the alias afterwards, which may stand for another collection by then.
    [[nodiscard]] Result<std::string> useCollection(const std::string& name);
    /// The same for all of them, those to come too.
    [[nodiscard]] Result<void> useAllCollections() { return authorization_.useAllCollections(); }
    /// Before a scan is received, as announced. Errors: kRateLimited.
    [[nodiscard]] Result<void> useScan(std::uint64_t points);
    /// The collection, after `useCollection`. Errors: kPermissionDenied, kNotFound.
    [[nodiscard]] Result<index::SnapshotPtr> collection(const std::string& name);
    /// The shape, with collection and key noted for the log. Errors: as Catalog::findShape.
    [[nodiscard]] Result<catalog::FoundShape> shape(const v1::ShapeRef& ref);
    /// Adds a field to the log line.
    void note(telemetry::Field field) { notes_.push_back(std::move(field)); }
    /// A log line of its own, with the call's trace.
    void info(const std::string& message, std::vector<telemetry::Field> fields) const;
    void noteKey(const std::string& key) { note({"key", key}); }
    void addPoints(std::uint64_t points, std::uint64_t bytes) {
        points_ += points;
        bytes_ += bytes;
    }

    /// Makes the status and writes the log line. Call once, last but for the next.
    [[nodiscard]] grpc::Status finish(Result<void> result);
    /// Before the one message of the answer is written: a client that does not read it is cut off. Until this
    /// is destroyed the call keeps its place among those that run, for it keeps its thread.
    template <typename Message>
    void beginAnswer(const Message& message) {
        cancellation_.beginAnswer(sizeOf(message));
    }
    /// When it could not be written: a log line, if its client was cut off.
    void noteUnreadAnswer();

  private:
    template <typename Message>
    static std::size_t sizeOf(const Message& message) {
        return message.ByteSizeLong();
    }
    static std::size_t sizeOf(const grpc::ByteBuffer& encoded) { return encoded.Length(); }
    [[nodiscard]] security::Credentials credentials() const;
    void logLine(const grpc::Status& status, const Error* error);

    const Services& services_;
    grpc::ServerContext& context_;
    const security::Operation& operation_;
    const bool inside_;       ///< made by another transport of this process
    const std::string peer_;  ///< asked at the start: a cancelled call has none
    std::chrono::steady_clock::time_point began_;
    CancelWatcher::Registration cancellation_;
    RunContext run_;
    catalog::CallFrame frame_;
    security::Authorization authorization_;
    std::string collection_;
    std::vector<telemetry::Field> notes_;
    std::uint64_t points_ = 0;
    std::uint64_t bytes_ = 0;
};

/// Runs `body(call)`, which returns Result<void>, from the beginning of a call to its end.
template <typename Body>
grpc::Status runCall(Call& call, Body&& body) {
    Result<void> result = catalog::guarded([&]() -> Result<void> {
        RETURN_IF_ERROR(call.begin());
        return body(call);
    });
    return call.finish(std::move(result));
}

/// W3C Trace Context, the header in which a client names the trace that a call belongs to: the trace id, 32
/// hexadecimal digits, of a `traceparent` (version-trace-parent-flags); nothing if it is not valid. Version
/// 00 ends there; later ones may go on after another dash, ff is none.
[[nodiscard]] std::optional<std::string> traceIdOf(std::string_view traceparent);

/// Between two reports of one stage.
constexpr std::chrono::milliseconds kBetweenStageReports{100};

/// The context of `call`; if `wanted`, its progress is written as `stage` of a `Message`: at once as a stage
/// begins, from time to time inside one. That the client has gone ends the work, not the writing. `call` and
/// `writer` must outlive it.
template <typename Message, typename Writer>
RunContext tellingStages(Call& call, Writer& writer, bool wanted) {
    RunContext context = call.run();
    if (!wanted) return context;
    context.progress = [&call, &writer, last = std::string_view(), next = RunContext::Clock::time_point()](
                           const char* stage, std::uint64_t done, std::uint64_t total) mutable {
        const auto now = RunContext::Clock::now();
        if (stage == last && now < next) return;
        last = stage;
        next = now + kBetweenStageReports;
        Message message;
        message.mutable_stage()->set_stage(stage);
        message.mutable_stage()->set_done(done);
        message.mutable_stage()->set_total(total);
        static_cast<void>(call.write(writer, message));
    };
    return context;
}

}  // namespace shapedb::rpc
