// SPDX-License-Identifier: GPL-3.0-or-later
// Export and import of one collection.
#include "core/base/return_if_error.h"
#include "server/catalog/catalog.h"
#include "server/catalog/file_name.h"
#include "server/catalog/request_checks.h"
#include "server/store/parameters_codec.h"

namespace shapedb::catalog {
namespace {

/// What a client could not have given a collection of its own, or what no search could read.
Result<void> checkImported(const store::Collection& collection) {
    RETURN_IF_ERROR(checkCollectionName(collection.name));
    RETURN_IF_ERROR(checkDescription(collection.description));
    const auto parameters = store::decodeParameters(collection.parameters);
    if (parameters) return {};
    return fail(ErrorCode::kMalformedFile, "the export cannot be imported: " + parameters.error().message);
}

Result<void> checkImported(const store::Shape& shape, std::uint64_t maxPoints) {
    if (maxPoints > 0 && shape.pointCount > maxPoints) {
        return fail(ErrorCode::kPointLimitExceeded,
                    "shape '" + shape.key + "' has " + std::to_string(shape.pointCount) +
                        " points, this server takes at most " + std::to_string(maxPoints) +
                        " (limits.max_points): raise it to import the collection");
    }
    const auto checked = checkMetadata(shape.metadata);
    if (checked) return {};
    return fail(withContext(checked.error(), "shape '" + shape.key + "': "));
}

}  // namespace

Result<std::uint64_t> Catalog::exportBytes(const std::string& name) {
    const auto found = collection(name);
    RETURN_IF_ERROR(found);
    return store_->exportBytes((*found)->collection.id);
}

Result<void> Catalog::exportCollection(const std::string& name, const std::string& path,
                                       const RunContext& context) {
    const auto found = collection(name);
    RETURN_IF_ERROR(found);
    // Nobody could import it.
    RETURN_IF_ERROR((*found)->requireParameters());
    return store_->exportCollection((*found)->collection.id, path, context);
}

Result<void> Catalog::admitImport(const std::string& name) const {
    RETURN_IF_ERROR(checkCollectionName(name));
    RETURN_IF_ERROR(requireContent());
    if (!index_.byName(name)) return {};
    return fail(ErrorCode::kAlreadyExists, "'" + name + "' is the name of a collection or an alias");
}

Result<index::SnapshotPtr> Catalog::importCollection(const std::string& path, const std::string& name,
                                                     const MayUse& mayUse, const RunContext& context) {
    const RestoreGate::Write write(restores_);
    RETURN_IF_ERROR(requireContent());
    std::optional<std::int64_t> prepared;
    store::ImportRequest request;
    request.name = name;
    request.accept = [&](const store::Collection& collection) -> Result<void> {
        RETURN_IF_ERROR(checkImported(collection));
        return mayUse(collection.name);
    };
    request.acceptShape = [most = options_.maxPoints](const store::Shape& shape) {
        return checkImported(shape, most);
    };
    // Before its jobs are queued: a worker's result must find its collection in the index.
    request.beforeVisible = [&](const store::Collection& collection) -> Result<void> {
        prepared = collection.id;
        RETURN_IF_ERROR(index_.prepare(collection, context));
        // Once more: all this may have taken long.
        return mayUse(collection.name);
    };
    const auto imported = store_->importCollection(path, request, context);
    if (!imported) {
        if (prepared) index_.remove(*prepared);
        return fail(named(imported.error(), path, "the file"));
    }
    auto shown = index_.show(imported->id);
    workers_.wake();
    return shown;
}

}  // namespace shapedb::catalog
