// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/quarantine.h"

#include <algorithm>
#include <string>

namespace shapedb::store {

bool crashed(const std::vector<Crash>& crashes, std::int64_t shapeId, std::int64_t pointsVersion) {
    return std::any_of(crashes.begin(), crashes.end(), [&](const Crash& crash) {
        return crash.shapeId == shapeId && crash.pointsVersion == pointsVersion;
    });
}

bool isQuarantined(const Deaths& deaths, int maxAttempts) {
    return deaths.crashes >= maxAttempts || deaths.stops >= kMostStops;
}

Error quarantineError(const Deaths& deaths) {
    const std::string what =
        deaths.crashes > 0
            ? "segmenting this scan crashed the server " + std::to_string(deaths.crashes) + " times"
            : "the server was ended " + std::to_string(deaths.stops) + " times while it segmented this scan";
    return {ErrorCode::kInternal,
            what + "; it is quarantined. Send it again or replace its points to try again"};
}

}  // namespace shapedb::store
