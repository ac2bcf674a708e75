// Passing an error on to the caller.
#pragma once

#include "core/base/error.h"

/// `RETURN_IF_ERROR(result);` returns the error of a Result, if it holds one, from the enclosing function,
/// which must return a Result of any type. `result` is evaluated once. The value, if any, is left where it
/// is:
///
///     auto points = readPoints(file);
///     RETURN_IF_ERROR(points);
///     RETURN_IF_ERROR(check(*points));
#define RETURN_IF_ERROR(...)                                                                        \
    do {                                                                                            \
        if (const auto& returnIfError_ = (__VA_ARGS__); !returnIfError_) return ::shapedb::fail(returnIfError_.error()); \
    } while (false)
