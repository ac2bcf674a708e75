// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/answer_room.h"

#include <string>

#include "core/base/return_if_error.h"

namespace shapedb::catalog {

Result<void> AnswerRoom::take(std::size_t bytes) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (bytes > left_) {
        return fail(ErrorCode::kInvalidArgument,
                    "the answer would exceed " + std::to_string(kMaxAnswerBytes) +
                        " bytes; ask for fewer shapes, hits or queries, or for no explanations");
    }
    RETURN_IF_ERROR(share_.take(bytes));
    left_ -= bytes;
    return {};
}

}  // namespace shapedb::catalog
