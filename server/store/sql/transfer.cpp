// SPDX-License-Identifier: GPL-3.0-or-later
// Export and import of one collection.
#include "core/base/return_if_error.h"
#include "server/store/sql/collection_copy.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql_store.h"

namespace shapedb::store {

namespace {

/// Beside blobs: rows, metadata, indices, and half a page of each blob that stays empty.
constexpr std::uint64_t kBytesBesideBlobs = 8192;

Collection onlyCollection(Connection& file, const std::string& path) {
    Query query(file, sql::kListCollections);
    std::vector<Collection> all;
    while (query.step()) all.push_back(readCollection(query));
    if (all.size() == 1) return std::move(all.front());
    raise(ErrorCode::kMalformedFile,
          "'" + path + "' cannot be imported: it holds " +
              (all.empty() ? "no collection"
                           : std::to_string(all.size()) +
                                 " collections, not one, and can only be restored as a whole"));
}

/// The content may have been replaced by a restore, and another collection have the id.
void requireHidden(Connection& connection, const Collection& hidden, const std::string& name) {
    const auto found = findCollection(connection, name);
    if (found && found->id == hidden.id) return;
    raise(ErrorCode::kUnavailable, "the content was replaced during the import: import again");
}

}  // namespace

Result<std::uint64_t> SqlStore::exportBytes(std::int64_t collectionId) {
    return read("read the size of the collection", [&](Connection& connection) -> std::uint64_t {
        requireCollection(connection, collectionId);
        Query query(connection, sql::kExportBytes, collectionId);
        if (!query.step()) return 0;
        return kBytesBesideBlobs * static_cast<std::uint64_t>(query.integer(0)) +
               static_cast<std::uint64_t>(query.integer(1));
    });
}

// A running import is a collection with a name that no client can give, which listings and statistics leave
// out; its shapes have no jobs yet. The last transaction gives it its name and its jobs.
Result<Collection> SqlStore::importFrom(const std::function<std::unique_ptr<Connection>()>& open,
                                        const std::string& path, const ImportRequest& request,
                                        const RunContext& context) {
    const std::unique_lock<std::mutex> oneAtATime(importMutex_, std::try_to_lock);
    if (!oneAtATime) return fail(ErrorCode::kRejected, "another import is running: try again after it");
    auto imported = guarded("import the collection", [&] {
        const auto file = open();
        const Collection from = onlyCollection(*file, path);
        Collection wanted = from;
        wanted.id = 0;
        if (!request.name.empty()) wanted.name = request.name;
        if (request.accept) orRaise(request.accept(wanted));
        orRaise(dropImport());  // what the last one could not remove
        const Collection hidden = beginImport(wanted);
        importShapes(*file, from, hidden, request, context);
        if (request.beforeVisible) orRaise(request.beforeVisible(hidden));
        return finishImport(hidden);
    });
    // The disk may be full: then it goes with the next import, or at the next start.
    if (!imported) static_cast<void>(dropImport());
    return imported;
}

Collection SqlStore::beginImport(const Collection& wanted) {
    orRaise(requireSpace());
    return orRaise(write("import the collection", [&](Connection& connection) {
        lockNames(connection);
        // Asked again at the end; to be refused here saves the time.
        requireFreeName(connection, wanted.name);
        Collection hidden = wanted;
        hidden.id = insertCollection(connection, wanted, importName());
        return hidden;
    }));
}

void SqlStore::importShapes(Connection& file, const Collection& from, const Collection& to,
                            const ImportRequest& request, const RunContext& context) {
    const std::uint64_t total = countShapesOf(file, from.id);
    std::uint64_t done = 0;
    for (std::int64_t afterId = 0;;) {
        orRaise(context.checkpoint());
        context.report("import", done, total);
        // Read outside the transaction: meanwhile others get their turn to write.
        const std::vector<CopiedShape> batch = nextShapes(file, from, afterId);
        if (batch.empty()) return;
        for (const CopiedShape& copied : batch) {
            if (request.acceptShape) orRaise(request.acceptShape(copied.shape));
        }
        orRaise(requireSpace());
        orRaise(write("import the collection", [&](Connection& connection) {
            lockCollection(connection, to.id);
            requireHidden(connection, to, importName());
            for (const CopiedShape& copied : batch) insertCopy(connection, to.id, copied);
        }));
        afterId = batch.back().shape.id;
        done += batch.size();
    }
}

Collection SqlStore::finishImport(const Collection& imported) {
    return orRaise(write("import the collection", [&](Connection& connection) {
        lockNames(connection);
        lockCollection(connection, imported.id);
        requireHidden(connection, imported, importName());
        requireFreeName(connection, imported.name);
        // However long the queue is: the bounds hold back uploads, whose points are not stored yet.
        Query(connection, sql::kRenameCollection, imported.id, imported.name).run();
        queuePending(connection, imported.id, now());
        logAll(connection, imported.id);
        return requireCollection(connection, imported.id);
    }));
}

Result<void> SqlStore::dropImport() noexcept {
    return dropHidden("remove an unfinished import", sql::kCollectionByName, importName());
}

}  // namespace shapedb::store
