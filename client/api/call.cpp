// SPDX-License-Identifier: Apache-2.0
#include "client/api/call.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <new>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <google/protobuf/descriptor.h>

#include "client/api/call_failure.h"
#include "common/safe_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

using Clock = RunContext::Clock;

/// How often a waiting call checks for cancellation.
constexpr auto kPoll = std::chrono::milliseconds(20);

/// Cancels an rpc when the flag is set: blocking stubs offer no other way. Starts a thread only for callers
/// that can cancel.
class CancelWatch {
  public:
    CancelWatch(grpc::ClientContext& rpc, const std::atomic<bool>* flag) {
        if (flag == nullptr) return;
        thread_ = std::thread([this, &rpc, flag] {
            std::unique_lock<std::mutex> lock(mutex_);
            while (!done_) {
                if (flag->load(std::memory_order_relaxed)) return rpc.TryCancel();
                wake_.wait_for(lock, kPoll);
            }
        });
    }
    CancelWatch(const CancelWatch&) = delete;
    CancelWatch& operator=(const CancelWatch&) = delete;
    ~CancelWatch() {
        if (!thread_.joinable()) return;
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            done_ = true;
        }
        wake_.notify_one();
        thread_.join();
    }

  private:
    std::mutex mutex_;
    std::condition_variable wake_;
    bool done_ = false;
    std::thread thread_;
};

/// The earlier of the caller's deadline and the client's.
Clock::time_point deadlineOf(const ClientOptions& options, const RunContext& context, CallTraits traits) {
    if (!traits.bounded || options.deadline.count() == 0) return context.deadline;
    return std::min(context.deadline, Clock::now() + options.deadline);
}

void setDeadline(grpc::ClientContext& rpc, Clock::time_point deadline) {
    if (deadline == Clock::time_point::max()) return;
    // gRPC takes wall-clock time; RunContext counts on the steady clock.
    rpc.set_deadline(
        std::chrono::system_clock::now() +
        std::chrono::duration_cast<std::chrono::system_clock::duration>(deadline - Clock::now()));
}

/// False if there is no time for it, or the caller cancels.
bool sleepFor(std::chrono::milliseconds delay, Clock::time_point deadline, const RunContext& context) {
    const auto until = Clock::now() + delay;
    if (until >= deadline) return false;
    while (Clock::now() < until) {
        if (!context.checkpoint()) return false;
        std::this_thread::sleep_for(std::min<Clock::duration>(kPoll, until - Clock::now()));
    }
    return true;
}

Result<void> makeCallUnguarded(const ClientOptions& options, const RunContext& context, CallTraits traits,
                               const Attempt& attempt) {
    RETURN_IF_ERROR(context.checkpoint());
    const Clock::time_point deadline = deadlineOf(options, context, traits);
    // Clients that failed together must not come back together.
    Random random(std::random_device{}());
    int inARow = 0;
    ErrorCode reason = ErrorCode::kInternal;
    while (true) {
        grpc::ClientContext rpc;
        setDeadline(rpc, deadline);
        if (!options.apiKey.empty()) rpc.AddMetadata("authorization", "Bearer " + options.apiKey);
        Result<void> local;
        grpc::Status status;
        {
            const CancelWatch watch(rpc, context.cancel);
            status = attempt(rpc, local);
        }
        RETURN_IF_ERROR(local);
        if (status.ok()) return {};
        // A cancellation by the caller comes back as a failure of the rpc.
        if (const auto proceed = context.checkpoint();
            !proceed && proceed.error().code == ErrorCode::kCancelled) {
            return fail(proceed.error());
        }
        const Error error =
            errorOf(status, rpc.GetServerTrailingMetadata(), {options.address, options.tls.enabled});
        if (!traits.idempotent) return fail(error);
        const AttemptFailure failure = failureOf(status, rpc.GetServerTrailingMetadata(), error);
        inARow = failure.code == reason ? inARow + 1 : 1;
        reason = failure.code;
        const auto delay = retryDelay(options.retry, inARow, failure, random);
        if (!delay || !sleepFor(*delay, deadline, context)) return fail(error);
    }
}

}  // namespace

Result<void> makeCall(const ClientOptions& options, const RunContext& context, CallTraits traits,
                      const google::protobuf::Message* text, const Attempt& attempt) {
    try {
        if (text != nullptr) RETURN_IF_ERROR(requireUtf8(*text));
        return makeCallUnguarded(options, context, traits, attempt);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the call");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("the call failed in the client: ") + e.what());
    }
}

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

Result<void> requireText(const FieldDescriptor& field, const std::string& text) {
    if (isUtf8(text)) return {};
    return fail(ErrorCode::kInvalidArgument,
                "the " + std::string(field.name()) + " '" + escapeUnsafe(text) +
                    "' is not UTF-8, which all text must be: rename it, or choose "
                    "another");
}

Result<void> requireField(const Message& message, const FieldDescriptor& field) {
    const Reflection& values = *message.GetReflection();
    const int count = field.is_repeated() ? values.FieldSize(message, &field) : 1;
    for (int i = 0; i < count; ++i) {
        if (field.type() == FieldDescriptor::TYPE_STRING) {
            std::string scratch;
            RETURN_IF_ERROR(requireText(
                field, field.is_repeated() ? values.GetRepeatedStringReference(message, &field, i, &scratch)
                                           : values.GetStringReference(message, &field, &scratch)));
        } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
            RETURN_IF_ERROR(requireUtf8(field.is_repeated() ? values.GetRepeatedMessage(message, &field, i)
                                                            : values.GetMessage(message, &field)));
        }
    }
    return {};
}

}  // namespace

Result<void> requireUtf8(const Message& request) {
    std::vector<const FieldDescriptor*> fields;
    request.GetReflection()->ListFields(request, &fields);
    for (const FieldDescriptor* field : fields) RETURN_IF_ERROR(requireField(request, *field));
    return {};
}

}  // namespace shapedb::client
