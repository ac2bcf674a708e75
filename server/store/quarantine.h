// Scans that bring the server down are not segmented for ever: after several crashes a scan is quarantined,
// which means failed until it is sent again, retried or replaced. A process that was killed proves nothing
// against the scans it had in hand, unless that happens over and over.
#pragma once

#include <cstdint>

#include "core/base/error.h"

namespace shapedb::store {

/// How the process ended while a scan was being segmented.
struct Deaths {
    std::int64_t crashes = 0;  ///< of the thread that segmented it
    std::int64_t stops = 0;    ///< for another reason: a kill, a power failure, a crash elsewhere
};

/// So many stops are no accident: the scan may exhaust the machine's memory each time.
constexpr std::int64_t kMostStops = 20;

/// Whether a scan is segmented alone, since it may end the process.
[[nodiscard]] inline bool isSuspect(const Deaths& deaths) { return deaths.crashes + deaths.stops > 0; }

/// Whether a scan is tried no more. `maxAttempts`: crashes.
[[nodiscard]] bool isQuarantined(const Deaths& deaths, int maxAttempts);

/// Why its shape is failed: kInternal.
[[nodiscard]] Error quarantineError(const Deaths& deaths);

}  // namespace shapedb::store
