// SPDX-License-Identifier: GPL-3.0-or-later
// Models that queries are simulated from, and how a query and its shape in the gallery share no point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb::bench {

/// A scan of a member of a synthetic family.
struct FamilyScan {
    std::string family;
    std::size_t member = 0;
    PointCloud points;
};

/// `members` of each family, scanned without noise in poses of their own, `points` each. Member i of every
/// family has the seed `seed` + i.
[[nodiscard]] Result<std::vector<FamilyScan>> scansOfFamilies(std::size_t members, std::size_t points,
                                                              std::uint64_t seed);

/// Every other point, from the first (0) or the second (1) on.
[[nodiscard]] PointCloud halfOf(const PointCloud& points, std::size_t which);

// Scans of one side as cameras make them, simulated from models.

struct OneSidedSettings {
    double noise = 0.003;  ///< standard deviation as a share of the box diagonal of the model
    double grazing =
        0.35;            ///< surface is lost below half of this cosine to the view, more and more up to 1.5
    double hole = 0.08;  ///< radius of the largest of up to two holes, as a share of the diagonal
    std::uint64_t least = 1000;  ///< points left, at random between these
    std::uint64_t most = 20000;
};

/// What a far camera sees of the model from a random direction (core/synthetic/degrade.h), without what
/// grazes the view, with holes, thinned out, and noisy. All random numbers come from `seed`. Where the
/// model gives no normals nothing is taken to graze.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<PointCloud> oneSidedScan(const PointCloud& model, const OneSidedSettings& settings,
                                              std::uint64_t seed, const RunContext& context);

}  // namespace shapedb::bench
