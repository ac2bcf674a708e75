// SPDX-License-Identifier: GPL-3.0-or-later
// Fills a database with ready-made shapes, for measurements at sizes that would take days to upload.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/base/run_context.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::bench {

struct FillShape {
    std::string key;  ///< unique
    Metadata metadata;
    std::string signature;  ///< as core/signature/signature_codec.h encodes it; not checked
};

/// Creates the database at `options.path`, or opens it as openSqliteStore does, makes the collection and
/// puts `count` READY shapes into it, `make(0)`, `make(1)`, ... Each has the same four points, so that
/// the database passes `check` (but a rebuild would replace all signatures by that of a tetrahedron).
/// Commits in batches: after an error some rows are already stored.
///
/// Errors: those of openSqliteStore; kAlreadyExists (collection, or a key); kCancelled,
/// kDeadlineExceeded. Not thread-safe.
[[nodiscard]] Result<void> fillDatabase(const store::SqliteOptions& options, const std::string& collection,
                                        const std::string& parameters, std::uint64_t count,
                                        const std::function<FillShape(std::uint64_t)>& make,
                                        const RunContext& context = {});

}  // namespace shapedb::bench
