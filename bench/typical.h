// SPDX-License-Identifier: GPL-3.0-or-later
// What two unrelated shapes differ by: where the constants kTypical of the attributed score and
// kTypicalMisfit of the fit come from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/signature/statistics.h"

namespace shapedb::bench {

/// Which scans stand for unrelated shapes: those of `shapedb sample` with the same numbers.
struct TypicalSettings {
    std::size_t perFamily = 6;   ///< scans of each synthetic family, at least 1
    std::size_t points = 20000;  ///< of each scan
    double noise = 0.002;        ///< standard deviation as a share of the diagonal
    std::uint64_t seed = 1;
    std::size_t fitEvery = 7;  ///< every n-th pair is aligned; at least 1
};

struct TypicalResult {
    std::size_t shapes = 0;
    std::size_t pairs = 0;  ///< of different families
    /// Medians over the pairs, in the units of typicalDifferences(): the statistics, then the parts.
    std::array<double, kStatisticKinds + 1> medians{};
    std::size_t fits = 0;             ///< pairs that were laid on each other
    std::array<double, 3> misfits{};  ///< medians of 1 - F over them, by FitKind
};

/// Describes the scans with the profile `default` and compares all pairs of different families.
///
/// Errors: kInvalidArgument; kCancelled, kDeadlineExceeded; those of the description.
[[nodiscard]] Result<TypicalResult> measureTypical(const TypicalSettings& settings,
                                                   const RunContext& context);

}  // namespace shapedb::bench
