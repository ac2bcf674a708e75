// SPDX-License-Identifier: Apache-2.0
// Forwarding an error to the caller.
#pragma once

#include "core/base/error.h"

/// `RETURN_IF_ERROR(result);` returns from the enclosing function, which must return some Result, if `result`
/// holds an error. `result` is evaluated once; its value, if any, stays where it is:
///
///     auto points = readPoints(file);
///     RETURN_IF_ERROR(points);
///     RETURN_IF_ERROR(check(*points));
#define RETURN_IF_ERROR(...)                                             \
    do {                                                                 \
        if (const auto& returnIfError_ = (__VA_ARGS__); !returnIfError_) \
            return ::shapedb::fail(returnIfError_.error());              \
    } while (false)
