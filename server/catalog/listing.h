// A page of a listing of shapes, whatever the transport.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/catalog.h"
#include "server/catalog/cursor.h"

namespace shapedb::catalog {

/// The shapes that a listing or a count is about.
struct ShapeSelection {
    std::string filter;  ///< docs/filters.md; empty: all
    std::optional<store::ShapeState> state;
};

struct ListRequest {
    ShapeSelection selection;
    std::uint32_t pageSize = 0;  ///< 0: the default
    std::string cursor;          ///< empty: from the start
};

/// Calls `visit` with each shape of the page, by id; it returns how many bytes the shape takes in the
/// answer, which ends the page before it grows too large. Returns the cursor of the next page, empty if
/// there is none. Errors: kInvalidArgument (page size, filter), kMalformedFilter, kMalformedCursor,
/// kCancelled, kDeadlineExceeded; those of the store.
[[nodiscard]] Result<std::string> listPage(
    Catalog& catalog, const index::Snapshot& collection, const ListRequest& request,
    const RunContext& context,
    const std::function<std::size_t(const store::Shape&, std::optional<double> quality)>& visit);

/// Errors: kInvalidArgument, kMalformedFilter, kCancelled, kDeadlineExceeded; those of the store.
[[nodiscard]] Result<std::uint64_t> countSelected(Catalog& catalog, const index::Snapshot& collection,
                                                  const ShapeSelection& selection, const RunContext& context);

}  // namespace shapedb::catalog
