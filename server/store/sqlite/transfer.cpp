// SPDX-License-Identifier: GPL-3.0-or-later
// Export and import of one collection.
#include "server/store/sql/rows.h"
#include "server/store/sqlite/database_file.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

Result<void> SqliteStore::exportCollection(std::int64_t collectionId, const std::string& path,
                                           const RunContext& context) {
    return guarded("export the collection", [&] {
        const NewFile file(path);
        {
            const Counted longRead(longReads_);
            SqliteConnection source(options_.path, OpenMode::kReadOnly, options_.busyTimeoutMs);
            const Transaction snapshot(source, Transaction::Kind::kRead);
            exportToFile(source, requireCollection(source, collectionId), file, options_, context);
        }
        file.publish();
    });
}

Result<Collection> SqliteStore::importCollection(const std::string& path, const ImportRequest& request,
                                                 const RunContext& context) {
    std::optional<TemporaryDatabase> temporary;
    return importFrom(
        [&]() -> std::unique_ptr<Connection> {
            temporary.emplace(options_.path + ".import");
            return checkedCopy(path, kImported, temporary->path(), options_, context);
        },
        path, request, context);
}

}  // namespace shapedb::store
