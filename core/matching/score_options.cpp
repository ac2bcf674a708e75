// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/score_options.h"

#include <sstream>

namespace shapedb {

Result<void> validate(const ScoreOptions& options) {
    if (options.kernelWidth >= kMinKernelWidth && options.kernelWidth <= kMaxKernelWidth) return {};
    std::ostringstream message;
    message << "kernel_width is " << options.kernelWidth << "; it must be " << kMinKernelWidth << " to "
            << kMaxKernelWidth;
    return fail(ErrorCode::kInvalidArgument, message.str());
}

}  // namespace shapedb
