// SPDX-License-Identifier: GPL-3.0-or-later
// Waiting for what other threads or processes do.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace shapedb::testing {

/// True as soon as `condition` holds, false when it does not within `atMost`.
inline bool eventually(const std::function<bool()>& condition,
                       std::chrono::milliseconds atMost = std::chrono::seconds(60),
                       std::chrono::milliseconds poll = std::chrono::milliseconds(2)) {
    const auto until = std::chrono::steady_clock::now() + atMost;
    while (!condition()) {
        if (std::chrono::steady_clock::now() >= until) return false;
        std::this_thread::sleep_for(poll);
    }
    return true;
}

}  // namespace shapedb::testing
