// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/failures.h"

#include <algorithm>
#include <map>

#include "client/cli/console.h"
#include "client/cli/text.h"

namespace shapedb::cli {

bool endsTheCommand(const Error& error) noexcept {
    switch (error.code) {
        case ErrorCode::kUnavailable:
        case ErrorCode::kCancelled:
        case ErrorCode::kDeadlineExceeded:
        case ErrorCode::kUnauthenticated:
        case ErrorCode::kPermissionDenied:
        case ErrorCode::kStorageFull:
        case ErrorCode::kFileNotWritable: return true;
        default: return false;
    }
}

void Failures::tell(Console& console, std::size_t all, const char* singular, const char* plural) const {
    std::map<std::string, std::size_t> alike;
    for (const Failure& one : failures_) ++alike[one.error.message];
    for (const Failure& one : failures_) {
        std::size_t& left = alike[one.error.message];
        if (left == 0) continue;  // reported with the first
        const bool named = one.error.message.find(one.item) != std::string::npos;
        std::string text = named ? one.error.message : one.item + ": " + one.error.message;
        if (left > 1) text += "; the same of " + formatCount(left - 1, "other", "others");
        console.note(text);
        left = 0;
    }
    if (all > 1 && !failures_.empty()) {
        console.note(formatCount(failures_.size()) + " of " + formatCount(all, singular, plural) + " failed");
    }
}

int Failures::exitCode(std::size_t all) const {
    if (failures_.empty()) return kOk;
    const int last = exitCodeOf(failures_.back().error.code);
    const bool interrupted = std::any_of(failures_.begin(), failures_.end(), [](const Failure& one) {
        return one.error.code == ErrorCode::kCancelled;
    });
    if (interrupted) return kInterrupted;
    return failures_.size() == all && (all == 1 || last == kUnavailable) ? last
                                                                         : static_cast<int>(kSomeFailed);
}

}  // namespace shapedb::cli
