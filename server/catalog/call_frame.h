// SPDX-License-Identifier: GPL-3.0-or-later
// The rules around every call, whatever its transport: who may enter, which error a client gets when
// several could be told, and when it may try again.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"

namespace shapedb::catalog {

/// One call, from its beginning to its end. Used by one thread. The references must outlive it.
class CallFrame {
  public:
    /// `run`: the caller's cancellation and deadline.
    CallFrame(const Catalog& catalog, Admission& admission, const RunContext& run);
    ~CallFrame();
    CallFrame(const CallFrame&) = delete;
    CallFrame& operator=(const CallFrame&) = delete;

    /// The caller's cancellation and deadline.
    [[nodiscard]] const RunContext& run() const { return run_; }

    /// First of all. Errors: kUnavailable (draining), kQueueFull (too many calls of this kind).
    [[nodiscard]] Result<void> admit(security::CallClass kind);

    /// Takes one of the places for calls that wait, until the call ends. Errors: kQueueFull.
    [[nodiscard]] Result<void> becomeFollower() { return follower_.take(1); }
    /// For calls that follow something for long. Errors: kCancelled, kDeadlineExceeded, kUnavailable
    /// (draining).
    [[nodiscard]] Result<void> checkpointWhileFollowing() const;

    /// For the call that replaces the database: a restore does not make it fail.
    void expectRestore() { expectsRestore_ = true; }
    /// The retry hint of this call, if it fails with kQueueFull.
    void retryAfter(std::chrono::milliseconds time) { whenQueueFull_ = time; }

    /// The result that the client gets: kUnavailable if the database was replaced meanwhile,
    /// kDeadlineExceeded for a cancellation that the deadline caused, otherwise `result`. A call that
    /// failed after the transport cut it off tells `cutOff`, the reason. Call once, last.
    [[nodiscard]] Result<void> settle(Result<void> result, const std::optional<Error>& cutOff);
    /// When to repeat a call that `settle` ended with an error; nothing if repeating does not help or
    /// nobody knows when it would.
    [[nodiscard]] std::optional<std::chrono::milliseconds> retryHint() const { return hint_; }

  private:
    const Catalog& catalog_;
    Admission& admission_;
    const RunContext& run_;
    Budget::Share follower_;
    std::uint64_t epoch_;
    std::optional<security::CallClass> admitted_;
    bool expectsRestore_ = false;
    std::chrono::milliseconds whenQueueFull_;
    std::optional<std::chrono::milliseconds> hint_;
};

/// Inside a catch block around the body of a call: what the exception means for the caller. kOutOfMemory or
/// kInternal.
[[nodiscard]] Error errorOfCall();

/// Runs `body`, which returns Result<void>; exceptions become errors.
template <typename Body>
Result<void> guarded(Body&& body) {
    try {
        return body();
    } catch (...) {
        return fail(errorOfCall());
    }
}

}  // namespace shapedb::catalog
