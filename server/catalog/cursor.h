// SPDX-License-Identifier: GPL-3.0-or-later
// The opaque text that tells where the next page of a listing starts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "server/store/store.h"

namespace shapedb::catalog {

/// The listing that a cursor continues; it is refused for any other.
struct Listing {
    std::int64_t collectionId = 0;
    std::string filter;
    int state = 0;  ///< 0: all; 1 + the number of a store::ShapeState
    std::string keyPrefix{};
    store::ShapeOrder order = store::ShapeOrder::kId;
    bool descending = false;
};

/// For the page after a shape that stood at this place. Letters and digits: version, place, checksum.
[[nodiscard]] std::string encodeCursor(const Listing& listing, const store::ShapeListing::Place& after);

/// The inverse, of what the order of the listing needs; nothing for an empty cursor, the start. Errors:
/// kMalformedCursor (damaged, of another version or of another listing).
[[nodiscard]] Result<std::optional<store::ShapeListing::Place>> decodeCursor(const Listing& listing,
                                                                             const std::string& cursor);

}  // namespace shapedb::catalog
