// The opaque text that tells where the next page of a listing starts.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/error.h"

namespace shapedb::catalog {

/// The listing that a cursor continues; it is refused for any other.
struct Listing {
    std::int64_t collectionId = 0;
    std::string filter;
    int state = 0;  ///< 0: all; 1 + the number of a store::ShapeState
};

/// For the page after the shape with id `afterId`. ASCII: version, id, checksum.
[[nodiscard]] std::string encodeCursor(const Listing& listing, std::int64_t afterId);

/// The inverse; an empty cursor is the start (0). Errors: kMalformedCursor (damaged, of another
/// version or of another listing).
[[nodiscard]] Result<std::int64_t> decodeCursor(const Listing& listing, const std::string& cursor);

}  // namespace shapedb::catalog
