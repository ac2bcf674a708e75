// SPDX-License-Identifier: GPL-3.0-or-later
// How errors travel inside a store: as the exception `Failure`, which `guarded` turns into an
// Error at the boundary of every public function. SQL code stays in straight lines, and
// transactions roll back on every way out.
#pragma once

#include <exception>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include "core/base/error.h"

namespace shapedb::store {

/// Thrown inside server/store/ only.
struct Failure : std::exception {
    Failure(ErrorCode code, std::string message, bool fromLibrary = false)
        : error{code, std::move(message)}, fromDatabase(fromLibrary) {}
    explicit Failure(Error why) : error(std::move(why)), fromDatabase(false) {}
    const char* what() const noexcept override { return error.message.c_str(); }

    Error error;
    bool fromDatabase;  ///< the message is the library's and needs the operation in front of it
};

/// What helps against damage, for the end of a message.
inline constexpr char kDamageRemedy[] =
    "run 'shapedb admin check', then restore a backup with 'shapedb admin restore'";

[[noreturn]] inline void raise(ErrorCode code, std::string message) {
    throw Failure(code, std::move(message));
}

/// A name as it appears in messages.
inline std::string quoted(const std::string& name) { return "'" + name + "'"; }

/// The value, or the error as a Failure.
template <typename T>
T orRaise(Result<T> result) {
    if (!result) throw Failure(result.error());
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// The exception being handled as an Error. `operation` completes "cannot ...".
inline Error handledError(const char* operation) noexcept {
    try {
        try {
            throw;
        } catch (const Failure& failure) {
            if (!failure.fromDatabase) return failure.error;
            return {failure.error.code, std::string("cannot ") + operation + ": " + failure.error.message};
        } catch (const std::bad_alloc&) {
        } catch (const std::exception& other) {
            return {ErrorCode::kInternal, std::string("cannot ") + operation + ": " + other.what()};
        }
    } catch (const std::bad_alloc&) {
        // There is no memory for the message either.
    }
    return {ErrorCode::kOutOfMemory, "out of memory"};  // fits without allocating
}

/// Runs the body of a public function and turns every exception into an Error. `operation`
/// completes "cannot ...".
template <typename Fn>
auto guarded(const char* operation, Fn&& body) noexcept -> Result<std::invoke_result_t<Fn>> {
    try {
        if constexpr (std::is_void_v<std::invoke_result_t<Fn>>) {
            body();
            return {};
        } else {
            return body();
        }
    } catch (const std::exception&) {
        return fail(handledError(operation));
    }
}

}  // namespace shapedb::store
