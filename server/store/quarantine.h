// SPDX-License-Identifier: GPL-3.0-or-later
// Scans that bring the server down are not segmented for ever: after several crashes a scan is quarantined,
// which means failed until it is sent again, retried or replaced. A process that was killed proves nothing
// against the scans it had in hand, unless that happens over and over.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"

namespace shapedb::store {

/// How the process ended while a scan was being segmented.
struct Deaths {
    std::int64_t crashes = 0;  ///< of the thread that segmented it
    std::int64_t stops = 0;    ///< for another reason: a kill, a power failure, a crash elsewhere
};

/// A scan whose segmentation crashed the process.
struct Crash {
    std::int64_t shapeId = 0;
    std::int64_t pointsVersion = 0;
};

/// Whether the scan is among those that crashed the process.
[[nodiscard]] bool crashed(const std::vector<Crash>& crashes, std::int64_t shapeId,
                           std::int64_t pointsVersion);

/// This many stops are not a coincidence: the scan may exhaust the machine's memory each time.
constexpr std::int64_t kMostStops = 20;

/// Whether a scan is segmented alone, since it may end the process.
[[nodiscard]] inline bool isSuspect(const Deaths& deaths) { return deaths.crashes + deaths.stops > 0; }

/// Whether a scan is tried no more. `maxAttempts`: crashes.
[[nodiscard]] bool isQuarantined(const Deaths& deaths, int maxAttempts);

/// Why its shape is failed: kInternal.
[[nodiscard]] Error quarantineError(const Deaths& deaths);

}  // namespace shapedb::store
