// SPDX-License-Identifier: GPL-3.0-or-later
// Pages of a listing of shapes, and counts, whatever the transport.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/catalog.h"
#include "server/catalog/gates.h"
#include "server/store/store.h"

namespace shapedb::catalog {

/// The shapes that a listing or a count is about.
struct ShapeSelection {
    std::string filter;  ///< docs/filters.md; empty: all
    std::optional<store::ShapeState> state;
    std::string keyPrefix{};  ///< empty: all
};

/// Checked, for the store. `context` must outlive it. Errors: kInvalidArgument (prefix), kMalformedFilter.
[[nodiscard]] Result<store::ShapeFilter> makeFilter(const ShapeSelection& selection,
                                                    const RunContext& context);

struct ListRequest {
    ShapeSelection selection;
    std::uint32_t pageSize = 0;  ///< 0: the default
    std::string cursor;          ///< empty: from the start
    store::ShapeOrder order = store::ShapeOrder::kId;
    bool descending = false;
};

/// Calls `visit` with each shape of the page, in the order of the request; it returns how many bytes the
/// shape takes in the answer, which ends the page before it grows too large. Returns the cursor of the next
/// page, empty if there is none. Errors: kInvalidArgument (page size, prefix), kMalformedFilter,
/// kMalformedCursor, kCancelled, kDeadlineExceeded; those of the store.
[[nodiscard]] Result<std::string> listPage(
    Catalog& catalog, const index::Snapshot& collection, const ListRequest& request,
    const RunContext& context,
    const std::function<std::size_t(const store::Shape&, std::optional<double> quality)>& visit);

/// Calls `visit` with the shape of each key, in their order, as above; what it returns is taken from `room`.
/// Returns the keys that no shape has. Errors: kInvalidArgument (keys); those of the store and of `room`.
[[nodiscard]] Result<std::vector<std::string>> visitShapes(
    Catalog& catalog, const index::Snapshot& collection, const std::vector<std::string>& keys,
    AnswerRoom& room,
    const std::function<std::size_t(const store::Shape&, std::optional<double> quality)>& visit);

/// Errors: kInvalidArgument, kMalformedFilter, kCancelled, kDeadlineExceeded; those of the store.
[[nodiscard]] Result<std::uint64_t> countSelected(Catalog& catalog, const index::Snapshot& collection,
                                                  const ShapeSelection& selection, const RunContext& context);

struct ValueCount {
    std::string value;
    std::uint64_t shapes = 0;
};
struct ValueCounts {
    std::vector<ValueCount> values;  ///< most shapes first, ties by value
    std::uint64_t otherValues = 0;   ///< that there was no room for
    std::uint64_t otherShapes = 0;   ///< that have those
    std::uint64_t without = 0;       ///< shapes without the key
};
/// How many of the shapes have which value under a metadata key; at most `maxValues` are named (0: the
/// default). Errors: as above; kInvalidArgument also for the key, `maxValues`, and more than
/// kMaxDifferentValues values.
[[nodiscard]] Result<ValueCounts> countByValue(Catalog& catalog, const index::Snapshot& collection,
                                               const ShapeSelection& selection,
                                               const std::string& metadataKey, std::uint32_t maxValues,
                                               const RunContext& context);

// Cursors: the opaque text that tells where the next page of a listing starts.

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
