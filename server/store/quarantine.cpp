#include "server/store/quarantine.h"

#include <string>

namespace shapedb::store {

bool isQuarantined(std::int64_t attempts, int maxAttempts) { return attempts >= maxAttempts; }

Error quarantineError(std::int64_t attempts) {
    return {ErrorCode::kInternal,
            "the server stopped " + std::to_string(attempts) +
                " times while it segmented this scan; it is quarantined. Replace its points, or rebuild "
                "the collection, to try again"};
}

}  // namespace shapedb::store
