// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/trace_parent.h"

#include <cstddef>

namespace shapedb::rpc {

std::optional<std::string> traceIdOf(std::string_view traceparent) {
    constexpr std::size_t kTraceAt = 3, kTraceDigits = 32, kParentAt = 36, kParentDigits = 16, kBytes = 55;
    if (traceparent.size() < kBytes) return std::nullopt;
    for (std::size_t i = 0; i < kBytes; ++i) {
        const bool dash = i == kTraceAt - 1 || i == kParentAt - 1 || i == kParentAt + kParentDigits;
        const bool digit =
            std::string_view("0123456789abcdef").find(traceparent[i]) != std::string_view::npos;
        if (dash ? traceparent[i] != '-' : !digit) return std::nullopt;
    }
    const std::string_view version = traceparent.substr(0, kTraceAt - 1);
    const bool ends = traceparent.size() == kBytes;
    if (version == "ff" || (version == "00" && !ends) || (!ends && traceparent[kBytes] != '-'))
        return std::nullopt;
    const std::string_view trace = traceparent.substr(kTraceAt, kTraceDigits);
    const std::string_view parent = traceparent.substr(kParentAt, kParentDigits);
    const auto allZero = [](std::string_view text) {
        return text.find_first_not_of('0') == std::string_view::npos;
    };
    if (allZero(trace) || allZero(parent)) return std::nullopt;
    return std::string(trace);
}

}  // namespace shapedb::rpc
