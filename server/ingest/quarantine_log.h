// SPDX-License-Identifier: GPL-3.0-or-later
// The log line of a quarantined scan, the same from workers and from rebuilds.
#pragma once

#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

inline void logQuarantine(telemetry::Logger& log, const store::Shape& shape, const Error& why) {
    log.error("scan set aside: the server died each time it was segmented",
              {{"shape", shape.id}, {"key", shape.key}, {"reason", why.message}});
}

}  // namespace shapedb::ingest
