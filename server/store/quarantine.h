// Scans that bring the server down are not segmented for ever: after several deaths of the process a
// scan is quarantined, which means failed until its points are replaced or its collection is rebuilt.
#pragma once

#include <cstdint>

#include "core/base/error.h"

namespace shapedb::store {

/// Whether a scan that the process died over `attempts` times is tried no more.
[[nodiscard]] bool isQuarantined(std::int64_t attempts, int maxAttempts);

/// Why its shape is failed: kInternal.
[[nodiscard]] Error quarantineError(std::int64_t attempts);

}  // namespace shapedb::store
