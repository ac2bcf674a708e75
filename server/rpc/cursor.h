// The opaque text that says where the next page of a listing starts.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/error.h"

namespace shapedb::rpc {

/// What a cursor belongs to: it continues this listing and no other.
struct Listing {
    std::int64_t collectionId = 0;
    std::string filter;
    int state = 0;  ///< of ListShapesRequest
};

/// The page after the shape with id `afterId`. ASCII, 1 version byte and checksum included.
[[nodiscard]] std::string encodeCursor(const Listing& listing, std::int64_t afterId);

/// The inverse; an empty cursor is the start (0). Errors: kMalformedCursor: damaged, of
/// another version, or of another listing.
[[nodiscard]] Result<std::int64_t> decodeCursor(const Listing& listing, const std::string& cursor);

}  // namespace shapedb::rpc
