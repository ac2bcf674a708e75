// SPDX-License-Identifier: GPL-3.0-or-later
// One call by the Connect protocol: the request's body becomes messages of a gRPC call, and its answers the
// answer's body.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/catalog/gates.h"
#include "server/http/envelope.h"
#include "server/http/inner_call.h"
#include "server/http/methods.h"
#include "server/http/request.h"
#include "server/http/response.h"

namespace shapedb::http {

/// Who sent the request and gets the answer. All on one executor, as the call itself.
class CallClient {
  public:
    virtual ~CallClient() = default;
    /// The whole answer; nothing follows.
    virtual void answer(Response response) = 0;
    /// The head of a streamed answer, with an empty body.
    virtual void beginStream(Response response) = 0;
    /// A piece of it; ConnectCall::sent follows once it is on its way.
    virtual void send(std::string bytes) = 0;
    /// The last piece; nothing follows.
    virtual void endStream(std::string bytes) = 0;
    /// The call takes more of the body now.
    virtual void wantsMore() = 0;
};

/// What all calls share. Thread-safe; outlives them.
struct CallServices {
    const Methods& methods;
    InnerCalls& calls;
    catalog::Budget& transit;  ///< bytes of messages on their way
};

/// Lives as long as the client and its gRPC call need it. Used on one executor only.
class ConnectCall : public std::enable_shared_from_this<ConnectCall> {
  public:
    using Post = std::function<void(std::function<void()>)>;

    /// `method` outlives it; `post` runs something on the executor, from any thread.
    ConnectCall(const CallServices& services, CallClient& client, const Method& method, CallForm form,
                std::string peer, Post post);

    /// First of all.
    void start();
    /// The next bytes of the body, while `wantsBody`.
    void body(std::string_view bytes);
    void bodyEnd();
    /// False: not now, or never again.
    [[nodiscard]] bool wantsBody() const;
    /// Whether it is the client that is waited for, and nobody but us who notices how long.
    [[nodiscard]] bool waitsForBodyAlone() const { return !inner_ && client_ != nullptr; }
    void sent();
    /// The client has gone: cancels the call, and touches the client no more.
    void abandon();
    /// The client is cut off: tells it why, as gRPC clients are told, and cancels the call.
    void cutOff(const Error& why);

  private:
    struct Message {
        std::string bytes;
        std::unique_ptr<catalog::Budget::Share> share;
    };

    OrFailure<void> take(std::string_view bytes);
    OrFailure<void> takeSpace(std::size_t bytes);
    OrFailure<void> enqueue(std::string message);
    OrFailure<void> finishBody();
    void startInner();
    void pump();
    void onWritten(bool good);
    void onMessage(std::string message);
    void onEnd(const Ending& ending);
    OrFailure<std::string> encoded(std::string message);
    void beginStream();
    void answer(const std::string& message, const Trailers& trailers);
    void fail(const Failure& failure, const Trailers& trailers = {});
    void leave();

    const CallServices services_;
    CallClient* client_;  ///< null: nothing more is reported
    const Method& method_;
    const CallForm form_;
    const std::string peer_;
    const Post post_;

    EnvelopeReader envelopes_;
    std::string unary_;  ///< the body so far, without envelopes
    std::unique_ptr<catalog::Budget::Share> incoming_;
    std::deque<Message> queue_;  ///< of what a single read of the body brought
    std::size_t messages_ = 0;   ///< of the request
    bool bodyEnded_ = false;

    std::shared_ptr<InnerCall> inner_;
    bool writing_ = false;
    bool halfClosed_ = false;
    bool streamBegun_ = false;
    std::vector<std::string> answers_;  ///< of a unary call: one
    std::unique_ptr<catalog::Budget::Share> outgoing_;
};

}  // namespace shapedb::http
