// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/bulk_changes.h"

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"
#include "server/catalog/listing.h"
#include "server/catalog/request_checks.h"
#include "server/store/put_rules.h"

namespace shapedb::catalog {
namespace {

/// One change of many shapes of a collection.
class BulkChange {
  public:
    BulkChange(Catalog& catalog, const index::Snapshot& collection, const RunContext& context)
        : catalog_(catalog),
          collectionId_(collection.collection.id),
          context_(context),
          epoch_(catalog.epoch()) {}

    using Batch = std::vector<store::Shape>;
    using Apply = std::function<Result<void>(const Batch&)>;

    [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
    /// Keys of the target that no shape has.
    [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

    /// Calls `apply` with the shapes of the target, a few at a time. `state`: those of a filter.
    Result<void> run(const ChangeTarget& target, const std::optional<store::ShapeState>& state,
                     const Apply& apply) {
        if (target.keys.has_value() == target.filter.has_value()) {
            return fail(ErrorCode::kInvalidArgument,
                        target.keys ? "selection: both keys and a filter are set: leave one out"
                                    : "selection: set keys or a filter; an empty filter means all shapes");
        }
        return target.keys ? byKeys(*target.keys, apply) : byFilter(*target.filter, state, apply);
    }

    /// Whether a shape that was read before is still meant.
    [[nodiscard]] bool isMeant(const store::Shape& shape) const {
        return shape.collectionId == collectionId_ && (!filter_.accept || filter_.accept(shape));
    }

  private:
    Result<void> byKeys(const std::vector<std::string>& keys, const Apply& apply) {
        RETURN_IF_ERROR(checkKeys(keys));
        std::set<std::string> seen;
        std::vector<std::string> distinct;
        for (const std::string& key : keys) {
            if (seen.insert(key).second) distinct.push_back(key);
        }
        auto found = catalog_.getShapes(collectionId_, distinct);
        RETURN_IF_ERROR(found);
        Batch shapes;
        for (std::size_t i = 0; i < distinct.size(); ++i) {
            if ((*found)[i]) {
                shapes.push_back(std::move(*(*found)[i]));
            } else {
                missing_.push_back(distinct[i]);
            }
        }
        return inBatches(shapes, apply);
    }

    Result<void> byFilter(const std::string& text, const std::optional<store::ShapeState>& state,
                          const Apply& apply) {
        auto filter = makeFilter({text, state, {}}, context_);
        RETURN_IF_ERROR(filter);
        filter_ = std::move(*filter);
        // Nothing is chased that is added meanwhile: ids rise.
        const auto last =
            catalog_.listShapes(collectionId_, {store::ShapeOrder::kId, true, std::nullopt}, 1, {});
        RETURN_IF_ERROR(last);
        if (last->empty()) return {};
        const std::int64_t lastId = last->front().id;
        for (std::int64_t afterId = 0; afterId < lastId;) {
            auto page = catalog_.listShapes(
                collectionId_, {store::ShapeOrder::kId, false, store::ShapeListing::Place{afterId}},
                kShapesPerChange, filter_);
            RETURN_IF_ERROR(page);
            if (page->empty()) return {};
            afterId = page->back().id;
            const auto beyond = std::find_if(page->begin(), page->end(),
                                             [&](const store::Shape& shape) { return shape.id > lastId; });
            page->erase(beyond, page->end());
            RETURN_IF_ERROR(inBatches(*page, apply));
        }
        return {};
    }

    Result<void> inBatches(const Batch& shapes, const Apply& apply) {
        for (auto begin = shapes.begin(); begin != shapes.end();) {
            auto end = begin;
            std::uint64_t bytes = 0;
            while (end != shapes.end() && static_cast<std::size_t>(end - begin) < kShapesPerChange) {
                bytes += end->pointCount * kPointBytes;
                if (end != begin && bytes > kPointBytesPerChange) break;
                ++end;
            }
            RETURN_IF_ERROR(context_.checkpoint());
            RETURN_IF_ERROR(apply(Batch(begin, end)));
            begin = end;
        }
        return {};
    }

    Catalog& catalog_;
    const std::int64_t collectionId_;
    const RunContext& context_;
    const std::uint64_t epoch_;
    store::ShapeFilter filter_;
    std::vector<std::string> missing_;
};

std::vector<std::int64_t> idsOf(const std::vector<store::Shape>& shapes) {
    std::vector<std::int64_t> ids;
    ids.reserve(shapes.size());
    for (const store::Shape& shape : shapes) ids.push_back(shape.id);
    return ids;
}

/// What a shape with the metadata `before` has afterwards, if no points are sent.
Metadata changed(const Metadata& before, const store::MetadataChange& change) {
    Metadata after = change.of(before);
    const std::string ofPoints = kMetadataOfPoints;
    for (auto entry = before.lower_bound(ofPoints);
         change.replaceAll && entry != before.end() && entry->first.rfind(ofPoints, 0) == 0; ++entry) {
        after.insert(*entry);  // unless it is set
    }
    return after;
}

}  // namespace

Result<BulkDeletion> deleteShapes(Catalog& catalog, const index::Snapshot& collection,
                                  const ChangeTarget& target, const RunContext& context) {
    BulkDeletion result;
    BulkChange change(catalog, collection, context);
    const auto apply = [&](const BulkChange::Batch& batch) -> Result<void> {
        const auto deleted = catalog.deleteShapes(
            change.epoch(), idsOf(batch), [&](const store::Shape& shape) { return change.isMeant(shape); });
        RETURN_IF_ERROR(deleted);
        result.deleted += deleted->size();
        return {};
    };
    RETURN_IF_ERROR(change.run(target, std::nullopt, apply));
    result.missing = change.missing();
    return result;
}

Result<BulkRetry> retryShapes(Catalog& catalog, const index::Snapshot& collection, const ChangeTarget& target,
                              const RunContext& context) {
    BulkRetry result;
    BulkChange change(catalog, collection, context);
    std::optional<Error> full;
    const auto apply = [&](const BulkChange::Batch& batch) -> Result<void> {
        std::vector<std::int64_t> failed;
        for (const store::Shape& shape : batch) {
            if (shape.state == store::ShapeState::kFailed) {
                failed.push_back(shape.id);
            } else {
                result.notFailed.push_back(shape.key);
            }
        }
        if (full) {
            result.left += failed.size();
            return {};
        }
        const auto queued = catalog.retryShapes(change.epoch(), failed);
        if (queued && *queued == failed.size()) {
            result.queued += *queued;
            return {};
        }
        if (!queued && queued.error().code != ErrorCode::kQueueFull) return fail(queued.error());
        // Fewer than asked for: the queue is full, or some are no longer there or no longer failed. Asked one
        // by one, the store says which.
        std::uint64_t now = queued.value_or(0);
        result.queued += now;
        for (const std::int64_t id : failed) {
            const auto one =
                full ? Result<std::uint64_t>(fail(*full)) : catalog.retryShapes(change.epoch(), {id});
            if (one) {
                result.queued += *one;
            } else if (one.error().code != ErrorCode::kQueueFull) {
                return fail(one.error());
            } else {
                full = one.error();
                const auto shape = catalog.shapeById(id);
                if (shape && shape->state == store::ShapeState::kFailed) ++result.left;
            }
        }
        return {};
    };
    RETURN_IF_ERROR(change.run(target, store::ShapeState::kFailed, apply));
    if (full && result.queued == 0) return fail(*full);
    result.missing = change.missing();
    return result;
}

Result<BulkMetadata> changeMetadata(Catalog& catalog, const index::Snapshot& collection,
                                    const std::string& filter, const store::MetadataChange& wanted,
                                    const RunContext& context) {
    RETURN_IF_ERROR(checkMetadataChange(wanted));
    BulkMetadata result;
    BulkChange change(catalog, collection, context);
    ChangeTarget target;
    target.filter = filter;
    const auto apply = [&](const BulkChange::Batch& batch) -> Result<void> {
        // Of this transaction, which may fail as a whole.
        BulkMetadata counts;
        const auto after = [&](const store::Shape& shape) -> std::optional<Metadata> {
            if (!change.isMeant(shape)) return std::nullopt;
            Metadata metadata = changed(shape.metadata, wanted);
            if (const auto checked = checkMetadata(metadata); !checked) {
                if (counts.refused++ == 0) {
                    counts.firstRefusedKey = shape.key;
                    counts.firstRefused = checked.error();
                }
                return std::nullopt;
            }
            if (metadata == shape.metadata) ++counts.unchanged;
            return metadata;
        };
        const auto done = catalog.changeMetadata(change.epoch(), idsOf(batch), after);
        RETURN_IF_ERROR(done);
        result.changed += done->size();
        result.unchanged += counts.unchanged;
        result.refused += counts.refused;
        if (counts.firstRefused && !result.firstRefused) {
            result.firstRefusedKey = std::move(counts.firstRefusedKey);
            result.firstRefused = std::move(counts.firstRefused);
        }
        return {};
    };
    RETURN_IF_ERROR(change.run(target, std::nullopt, apply));
    return result;
}

Result<ChangedShape> changeMetadataOf(Catalog& catalog, const index::SnapshotPtr& collection,
                                      const std::string& key, const store::MetadataChange& change,
                                      const std::optional<std::int64_t>& expectedVersion) {
    RETURN_IF_ERROR(checkMetadataChange(change));
    RETURN_IF_ERROR(checkExpectedVersion(expectedVersion));
    const std::uint64_t epoch = catalog.epoch();
    auto found = catalog.findShape(collection, key);
    RETURN_IF_ERROR(found);
    std::optional<store::Shape> seen;
    Result<void> allowed;
    const auto after = [&](const store::Shape& shape) -> std::optional<Metadata> {
        seen = shape;
        Metadata metadata = changed(shape.metadata, change);
        const bool repeated = metadata == shape.metadata && expectedVersion == shape.version - 1;
        if (!repeated) allowed = store::requireVersion(key, shape.version, expectedVersion);
        if (allowed) allowed = checkMetadata(metadata);
        return allowed ? std::optional<Metadata>(std::move(metadata)) : std::nullopt;
    };
    auto done = catalog.changeMetadata(epoch, {found->shape.id}, after);
    RETURN_IF_ERROR(done);
    RETURN_IF_ERROR(allowed);
    if (!seen) return fail(store::noSuchShape(collection->collection.name, key));  // deleted meanwhile
    if (done->empty()) return ChangedShape{false, std::move(*seen)};
    return ChangedShape{true, std::move(done->front())};
}

}  // namespace shapedb::catalog
