// SPDX-License-Identifier: GPL-3.0-or-later
// Large databases, made without uploading.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/signature_generator.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb::bench {

/// Seeded scans of the project's synthetic families in turn, each another member in another pose, with
/// noise of 0.5 % of the diagonal. Errors: kCancelled, kInvalidArgument (points).
[[nodiscard]] Result<std::vector<PointCloud>> makeScans(std::size_t count, std::size_t points,
                                                        std::uint64_t seed, unsigned threads,
                                                        const RunContext& context);

/// The file that a server with the data directory `data` (created here) opens, with `count` shapes in
/// the collection "default": key, one label and signature each. Errors: those of fillDatabase.
[[nodiscard]] Result<void> fillDataDirectory(const std::string& data, const SignatureGenerator& generator,
                                             std::uint64_t count, const RunContext& context);

}  // namespace shapedb::bench
