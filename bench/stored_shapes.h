// SPDX-License-Identifier: GPL-3.0-or-later
// Large databases, made without uploading, for measurements at sizes that would take days to upload.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/signature_generator.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::bench {

/// Seeded scans of the project's synthetic families in turn, each another member in another pose, with
/// noise of 0.5 % of the diagonal. Errors: kCancelled, kInvalidArgument (points).
[[nodiscard]] Result<std::vector<PointCloud>> makeScans(std::size_t count, std::size_t points,
                                                        std::uint64_t seed, unsigned threads,
                                                        const RunContext& context);

/// x y z of each point, as scans are stored.
[[nodiscard]] std::vector<float> packedPoints(const PointCloud& scan);

/// The file that a server with the data directory `data` (created here) opens, with `count` shapes in
/// the collection "default": key, one label and signature each. Errors: those of fillDatabase.
[[nodiscard]] Result<void> fillDataDirectory(const std::string& data, const SignatureGenerator& generator,
                                             std::uint64_t count, const RunContext& context);

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
