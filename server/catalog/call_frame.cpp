// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/call_frame.h"

#include <exception>
#include <new>
#include <string>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"

namespace shapedb::catalog {

CallFrame::CallFrame(const Catalog& catalog, Admission& admission, const RunContext& run)
    : catalog_(catalog),
      admission_(admission),
      run_(run),
      follower_(admission.followers),
      epoch_(catalog.epoch()),
      whenQueueFull_(kBudgetRetry) {}

CallFrame::~CallFrame() {
    if (admitted_) admission_.calls.leave(*admitted_);
}

Result<void> CallFrame::admit(security::CallClass kind) {
    RETURN_IF_ERROR(admission_.calls.enter(kind));
    admitted_ = kind;
    return {};
}

Result<void> CallFrame::checkpointWhileFollowing() const {
    if (admission_.calls.draining()) {
        return fail(ErrorCode::kUnavailable,
                    "the server is shutting down: the work continues after its restart");
    }
    return run_.checkpoint();
}

Result<void> CallFrame::settle(Result<void> result, const std::optional<Error>& cutOff) {
    if (!expectsRestore_ && catalog_.epoch() != epoch_) {
        // Ids read before the restore mean other shapes now.
        result = fail(ErrorCode::kUnavailable,
                      "the database was replaced by a backup while the call ran: repeat it");
    }
    if (result) return result;
    if (cutOff) return fail(*cutOff);
    // A transport cancels a call whose deadline passed; the deadline is the reason.
    if (result.error().code == ErrorCode::kCancelled && RunContext::Clock::now() >= run_.deadline) {
        result = fail(ErrorCode::kDeadlineExceeded, "the deadline passed before the work was done");
    }
    const ErrorCode code = result.error().code;
    if (code == ErrorCode::kQueueFull) hint_ = whenQueueFull_;
    // Nothing but a restore makes a server that is not draining unavailable.
    if (code == ErrorCode::kUnavailable && !admission_.calls.draining()) hint_ = kRestoreRetry;
    return result;
}

Error errorOfCall() {
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return {ErrorCode::kOutOfMemory, "not enough memory for this request: try again later"};
    } catch (const std::exception& error) {
        return {ErrorCode::kInternal, std::string("unexpected failure: ") + error.what()};
    } catch (...) {
        return {ErrorCode::kInternal, "unexpected failure of unknown kind"};
    }
}

}  // namespace shapedb::catalog
