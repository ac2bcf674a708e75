#include "server/catalog/listing.h"

#include <algorithm>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/search/filter.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"

namespace shapedb::catalog {

namespace {

/// Errors: kInvalidArgument (length), kMalformedFilter.
Result<store::ShapeFilter> makeFilter(const ShapeSelection& selection, const RunContext& context) {
    RETURN_IF_ERROR(checkFilterLength(selection.filter));
    Result<Filter> filter = Filter::parse(selection.filter);
    RETURN_IF_ERROR(filter);
    store::ShapeFilter result;
    result.state = selection.state;
    result.context = context;
    // With no `accept` the store counts without reading rows.
    if (filter->acceptsAll()) return result;
    result.accept = [filter = std::move(*filter)](const store::Shape& shape) {
        return filter.matches(shape.metadata);
    };
    return result;
}

/// What a cursor is bound to: 0 for all states.
int cursorState(const std::optional<store::ShapeState>& state) {
    return state ? 1 + static_cast<int>(*state) : 0;
}

}  // namespace

Result<std::string> listPage(
    Catalog& catalog, const index::Snapshot& collection, const ListRequest& request,
    const RunContext& context,
    const std::function<std::size_t(const store::Shape&, std::optional<double> quality)>& visit) {
    RETURN_IF_ERROR(checkPageSize(request.pageSize));
    const auto filter = makeFilter(request.selection, context);
    RETURN_IF_ERROR(filter);
    const Listing listing{collection.collection.id, request.selection.filter,
                          cursorState(request.selection.state)};
    const auto afterId = decodeCursor(listing, request.cursor);
    RETURN_IF_ERROR(afterId);

    const std::size_t pageSize = request.pageSize == 0 ? kDefaultPageSize : request.pageSize;
    // One more than requested tells whether there is a next page.
    const auto shapes = catalog.listShapes(listing.collectionId, *afterId, pageSize + 1, *filter);
    RETURN_IF_ERROR(shapes);
    std::size_t bytes = 0;
    std::size_t sent = 0;
    for (; sent < std::min(pageSize, shapes->size()) && bytes < kMaxPageBytes; ++sent) {
        const store::Shape& shape = (*shapes)[sent];
        bytes += visit(shape, qualityIn(collection.signatures, shape.id));
    }
    return sent < shapes->size() ? encodeCursor(listing, (*shapes)[sent - 1].id) : std::string();
}

Result<std::uint64_t> countSelected(Catalog& catalog, const index::Snapshot& collection,
                                    const ShapeSelection& selection, const RunContext& context) {
    const auto filter = makeFilter(selection, context);
    RETURN_IF_ERROR(filter);
    return catalog.countShapes(collection.collection.id, *filter);
}

}  // namespace shapedb::catalog
