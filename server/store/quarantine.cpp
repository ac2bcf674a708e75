#include "server/store/quarantine.h"

#include <string>

namespace shapedb::store {

bool isQuarantined(const Deaths& deaths, int maxAttempts) {
    return deaths.crashes >= maxAttempts || deaths.stops >= kMostStops;
}

Error quarantineError(const Deaths& deaths) {
    const std::string what =
        deaths.crashes > 0
            ? "segmenting this scan crashed the server " + std::to_string(deaths.crashes) + " times"
            : "the server was ended " + std::to_string(deaths.stops) + " times while it segmented this scan";
    return {ErrorCode::kInternal,
            what + "; it is quarantined. Send it again, retry it or replace its points to try again"};
}

}  // namespace shapedb::store
