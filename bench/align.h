// SPDX-License-Identifier: GPL-3.0-or-later
// How well, and how fast, the motion between two scans of a shape is found: whole scans, scans from one side
// and pieces, simulated from models, so that the motion is known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bench/peers.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/fit.h"
#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb::bench {

struct AlignSettings {
    double noise = 0.003;  ///< of the query: standard deviation as a share of the box diagonal
    std::uint64_t seed = 1;
    FitOptions fit;        ///< its kind is not read
    bool toldKind = true;  ///< fitted as what the condition says; otherwise automatic
};

/// What is missing from a query, and the kind it is fitted as when the fit is given one.
struct AlignCondition {
    const char* name;
    FitKind kind;
    double left;  ///< of the points of a piece
};

inline constexpr std::array<AlignCondition, 4> kAlignConditions = {{
    {"whole", FitKind::kWhole, 1.0},
    {"one-sided", FitKind::kOneSided, 1.0},
    {"piece, 65 % left", FitKind::kPiece, 0.65},
    {"piece, 50 % left", FitKind::kPiece, 0.5},
}};

struct AlignOutcome {
    double error = 1.0;        ///< see motionError; 1 when no surface points could be made
    double bestOfEqual = 1.0;  ///< the smallest error of the answer and its alternatives
    double score = 0.0;
    double seconds = 0.0;  ///< processor time of one thread; of a fit without making the surface points
    FitKind kind = FitKind::kWhole;
};

/// Root of the mean squared distance between a model moved in two ways, from both sides, as a share of the
/// diagonal of its axis-aligned box: motions that a symmetry makes equal have no error.
[[nodiscard]] double motionError(const PointCloud& model, const Motion& found, const Motion& truth);

/// Two scans of a shape, one moved against the other.
struct AlignCase {
    PointCloud query;
    PointCloud other;
    Motion truth;  ///< takes `other` to `query`
};

/// Takes every other point of `model` for the query and the rest for the other shape (all for both, if there
/// are less than 8,000), adds noise to the query, takes away what the condition says, and moves both at
/// random: the query is also mirrored, in half of the cases, if reflection is allowed, and scaled by 1/2 to 2
/// unless the scale is kept. All random numbers come from `seed`.
///
/// Errors: those of the noise.
[[nodiscard]] Result<AlignCase> makeAlignCase(const PointCloud& model, const AlignCondition& condition,
                                              const AlignSettings& settings, std::uint64_t seed);

/// By fit. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<AlignOutcome> measureAlignment(const AlignCase& one, const AlignCondition& condition,
                                                    const AlignSettings& settings, const RunContext& context);

/// By another aligner, from the points themselves. `score` and `kind` are not set. A failure to align counts
/// as an error of 1.
[[nodiscard]] AlignOutcome measureAlignment(const AlignCase& one, const PeerAligner& peer);

}  // namespace shapedb::bench
