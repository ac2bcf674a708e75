// SPDX-License-Identifier: GPL-3.0-or-later
// Export and import of one collection.
#include "core/base/return_if_error.h"
#include "server/store/put_rules.h"
#include "tests/server/support/memory_store.h"

namespace shapedb::testing {

using namespace shapedb::store;

Result<std::uint64_t> MemoryStore::exportBytes(std::int64_t collectionId) {
    return guarded("exportBytes", [&]() -> Result<std::uint64_t> {
        if (content_.collections.count(collectionId) == 0)
            return fail(ErrorCode::kNotFound, "no such collection");
        return 1;
    });
}

Result<void> MemoryStore::exportCollection(std::int64_t collectionId, const std::string& path,
                                           const RunContext& context) {
    return guarded("exportCollection", [&]() -> Result<void> {
        if (const auto go = context.checkpoint(); !go) return go;
        const auto found = content_.collections.find(collectionId);
        if (found == content_.collections.end()) return fail(ErrorCode::kNotFound, "no such collection");
        Content copy;
        copy.collections.insert(*found);
        for (const auto& [id, shape] : content_.shapes) {
            if (shape.collectionId != collectionId) continue;
            copy.shapes[id] = shape;
            copy.points[id] = content_.points.at(id);
            if (const auto row = content_.signatures.find(id); row != content_.signatures.end())
                copy.signatures.insert(*row);
            if (const auto row = content_.surfaces.find(id); row != content_.surfaces.end())
                copy.surfaces.insert(*row);
        }
        if (!exports_.emplace(path, std::move(copy)).second)
            return fail(ErrorCode::kAlreadyExists, path + " is there");
        return {};
    });
}

// The functions of the request call the store: no lock is held meanwhile, and the content is added twice,
// first under a name that nobody asks for.
Result<Collection> MemoryStore::importCollection(const std::string& path, const ImportRequest& request,
                                                 const RunContext& context) {
    RETURN_IF_ERROR(context.checkpoint());
    const auto file = exports_.find(path);
    if (file == exports_.end()) return fail(ErrorCode::kFileNotReadable, path + " is missing");
    const Content& from = file->second;
    Collection wanted = from.collections.begin()->second;
    wanted.id = 0;
    if (!request.name.empty()) wanted.name = request.name;
    if (request.accept) RETURN_IF_ERROR(request.accept(wanted));
    for (const auto& [id, shape] : from.shapes) {
        if (request.acceptShape) RETURN_IF_ERROR(request.acceptShape(shape));
    }
    const auto begun = guarded("importCollection", [&]() -> Result<void> {
        if (isTaken(wanted.name)) return fail(ErrorCode::kAlreadyExists, "the name is taken");
        wanted.id = content_.nextId++;
        Collection hidden = wanted;
        hidden.name = ".import";
        content_.collections[hidden.id] = hidden;
        for (const auto& [id, shape] : from.shapes) {
            Shape copy = shape;
            copy.id = content_.nextId++;
            copy.collectionId = hidden.id;
            content_.shapes[copy.id] = copy;
            content_.points[copy.id] = from.points.at(id);
            if (const auto row = from.signatures.find(id); row != from.signatures.end()) {
                content_.signatures[copy.id] = row->second;
                content_.signatures[copy.id].shapeId = copy.id;
            }
            if (const auto row = from.surfaces.find(id); row != from.surfaces.end())
                content_.surfaces[copy.id] = row->second;
        }
        return {};
    });
    RETURN_IF_ERROR(begun);
    Result<void> done = request.beforeVisible ? request.beforeVisible(wanted) : Result<void>();
    if (done) {
        done = guarded("finishImport", [&]() -> Result<void> {
            if (isTaken(wanted.name)) return fail(ErrorCode::kAlreadyExists, "the name is taken");
            content_.collections[wanted.id].name = wanted.name;
            for (const auto& [id, shape] : content_.shapes) {
                if (shape.collectionId == wanted.id && shape.state == ShapeState::kPending) queueJob(shape);
            }
            return {};
        });
    }
    if (done) return wanted;
    static_cast<void>(deleteCollection(wanted.id));
    return fail(done.error());
}

}  // namespace shapedb::testing
