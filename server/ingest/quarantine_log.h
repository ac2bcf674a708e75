// The log line of a quarantined scan, the same from workers and from rebuilds.
#pragma once

#include <cstdint>

#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

inline void logQuarantine(telemetry::Logger& log, const store::Shape& shape, std::int64_t attempts) {
    log.error("scan set aside: the server died each time it was segmented",
              {{"shape", shape.id}, {"key", shape.key}, {"attempts", attempts}});
}

}  // namespace shapedb::ingest
