// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/net/transfer_pace.h"

namespace shapedb::net {

std::string reasonOf(Pace pace, const PaceLimits& limits) {
    if (pace == Pace::kStalled) {
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limits.stall);
        return "the client neither sent nor read anything for " + std::to_string(seconds.count()) +
               " seconds (limits.stall_seconds)";
    }
    return "the client sent or read less than " + std::to_string(limits.leastRate) +
           " bytes per second (limits.min_bytes_per_second)";
}

}  // namespace shapedb::net
