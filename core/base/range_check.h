// SPDX-License-Identifier: Apache-2.0
// Range checks of parameters.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace shapedb {

/// Errors: kInvalidArgument unless `holds`: "FIELD is VALUE; it must be RANGE".
[[nodiscard]] inline Result<void> requireInRange(bool holds, const char* field, double value,
                                                 const char* range) {
    if (holds) return {};
    return fail(ErrorCode::kInvalidArgument,
                std::string(field) + " is " + numberText(value) + "; it must be " + range);
}

}  // namespace shapedb
