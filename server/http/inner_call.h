// SPDX-License-Identifier: GPL-3.0-or-later
// Calls of the gRPC server in this process: they meet the same handlers, rules, limits
// and log lines as those of a gRPC client.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/client_callback.h>

#include "server/http/failure.h"
#include "server/http/request.h"
#include "server/rpc/inside.h"

namespace shapedb::http {

class InnerCalls;

/// How a call ended.
struct Ending {
    bool good = false;
    Failure failure;  ///< unless good
    Trailers trailers;
};

/// One call. All of it on the caller's own executor (its strand): its functions are called there, and its
/// events come there. Made by InnerCalls; lives until its last event.
class InnerCall final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
  public:
    struct Events {
        /// Runs something on the caller's executor, soon. Thread-safe.
        std::function<void(std::function<void()>)> post;
        std::function<void(bool good)> onWritten;            ///< after each `write`
        std::function<void(std::string message)> onMessage;  ///< after each `read`, unless there are no more
        std::function<void(Ending)> onEnd;  ///< the last event; after it the functions do nothing
    };

    InnerCall(InnerCalls& calls, Events events);
    ~InnerCall() override;

    /// One message at a time. Does nothing after the end.
    void write(std::string message);
    void writesDone();
    void read();
    /// No event but `onEnd` follows.
    void cancel();

  private:
    friend class InnerCalls;
    void OnWriteDone(bool good) override;
    void OnReadDone(bool good) override;
    void OnDone(const grpc::Status& status) override;
    void noMoreOperations();

    InnerCalls& calls_;
    Events events_;
    grpc::ClientContext context_;
    grpc::ByteBuffer outgoing_;
    grpc::ByteBuffer incoming_;
    bool over_ = false;                ///< nothing may be started any more; on the caller's executor
    std::shared_ptr<InnerCall> self_;  ///< until the last event
};

/// Makes calls. Thread-safe. Outlives them.
class InnerCalls {
  public:
    explicit InnerCalls(rpc::Inside inside);

    /// Starts a call; `peer` is the client's address as it goes into the log.
    [[nodiscard]] std::shared_ptr<InnerCall> start(const Method& method, const CallForm& form,
                                                   const std::string& peer, InnerCall::Events events);
    /// Waits until every call that was started has had its last event handed to its executor.
    void waitUntilNone();

  private:
    friend class InnerCall;
    void count(int change);

    const rpc::Inside inside_;
    grpc::GenericStub stub_;
    std::mutex mutex_;
    std::condition_variable changed_;
    int running_ = 0;
};

}  // namespace shapedb::http
