// SPDX-License-Identifier: GPL-3.0-or-later
// Aligning two shapes by their surface points: where exactly does the other shape lie on the query, how well
// does it explain what was scanned, and which other poses are equally good? docs/fit.md describes the method.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/surface_points.h"
#include "core/geometry/motion.h"

namespace shapedb {

/// What the query is a scan of. The other shape is always taken to be whole.
enum class FitKind {
    kWhole,     ///< all of the surface
    kOneSided,  ///< what one camera saw from far away
    kPiece,     ///< all sides of a part: some was cut off, or there are holes
};

/// What the query may be a scan of: at least one. Each takes the time of a fit.
struct FitKinds {
    bool whole = true;
    bool oneSided = true;
    bool piece = true;

    [[nodiscard]] static FitKinds only(FitKind kind);
    [[nodiscard]] bool allows(FitKind kind) const;
};

/// What 1 - F of two unrelated shapes typically is, fitted as this kind: the medians over pairs of
/// different synthetic families (`shapedb-bench typical`). Kinds that leave parts of the other shape
/// unexplained score more easily.
[[nodiscard]] double typicalMisfit(FitKind kind) noexcept;

struct FitOptions {
    FitKinds kinds;          ///< of several, the one with the least misfit is taken
    bool keepScale = false;  ///< both shapes have the same unit of length: motions have scale 1
    bool reflection = true;  ///< a mirrored shape may be laid on the query
};

/// One way of laying the other shape on the query.
struct FitPose {
    Motion motion;       ///< takes coordinates of the other shape to those of the query
    double score = 0.0;  ///< F = sqrt(explainedQuery * explainedOther), 0 to 1
    /// How much of the query's surface lies on the other's, 0 to 1. A point at distance d counts
    /// (1 + d^2 / w^2)^-2, w = 2 % of the query's diagonal.
    double explainedQuery = 0.0;
    /// The same of the part of the other's surface that the query should have seen: all (whole), what is in
    /// front (one-sided), what lies within the query's hull (piece).
    double explainedOther = 0.0;
    /// Root of the mean squared distance of query points from the other's surface, over those nearer than
    /// 3 w; a share of the query's diagonal. 0 where there are none.
    double residual = 0.0;
};

/// Turning the other shape about this line, by any angle, changes nothing that the points show.
struct FreeAxis {
    Point3 point;      ///< query coordinates
    Point3 direction;  ///< unit vector
};

struct FitResult {
    FitPose best;
    FitKind kind = FitKind::kWhole;  ///< as what the query was fitted
    /// (1 - F - e) / (typicalMisfit(kind) - e) of the best, at least 0, where e = 0.06 is what two scans of
    /// one object differ by at best: 0 if the shapes coincide, about 1 if they are unrelated.
    double misfit = 1.0;
    /// 1 - F of the best clearly different pose / F of the best: 0 when another is as good, 1 when no other
    /// pose comes near: poses that fall below 0.85 of the best before the last stage are dropped and do not
    /// count. Turns about a free axis are not different poses.
    double certainty = 0.0;
    /// Clearly different poses (more than 4 % of the query's diagonal apart) whose score is within 3 % of the
    /// best, best first; at most kMostAlternatives, of however many there are.
    std::vector<FitPose> alternatives;
    /// A mirrored and an unmirrored pose are as good (both score within 1 % of the better): the points do not
    /// tell left from right. `best` is then the unmirrored one. Never without FitOptions::reflection. `fit`
    /// may miss it, `align` does not.
    bool handednessOpen = false;
    std::vector<FreeAxis> axes;  ///< one for a bottle; three for a ball, which may be turned any way
};

/// How many poses beside the best are refined to the end: three, and one of the other hand if all of those
/// have the same. More would slow down every fit of a search for the sake of rare shapes (a cube has 24).
constexpr std::size_t kMostAlternatives = 4;

struct FitPoints;

/// A query made ready once for any number of fits. Immutable, cheap to copy: may be used by any number of
/// threads at once. All lengths called "diagonal" are those of the box along the principal axes of its
/// points.
class FitQuery {
  public:
    /// `surface` must come from makeSurfacePoints or decodeSurfacePoints.
    explicit FitQuery(const SurfacePoints& surface);

    /// Scan units of the query.
    [[nodiscard]] double diagonal() const;
    [[nodiscard]] const FitPoints& points() const { return *points_; }

  private:
    std::shared_ptr<const FitPoints> points_;
};

/// Finds the pose in which the other shape explains the query best, and the poses that are as good. Runs on
/// the calling thread alone, uses no random numbers, and depends on nothing but its arguments: fits of many
/// candidates may run side by side. Looks at the context every few hundred microseconds; reports progress as
/// stage "fit".
///
/// A pose is a similarity, or with `keepScale` a congruence. There is always a result; a low score says that
/// the shapes do not agree.
///
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<FitResult> fit(const FitQuery& query, const SurfacePoints& other,
                                    const FitOptions& options = {}, const RunContext& context = {});

/// Whether a mirrored result of `fit`, with the same arguments, had to be mirrored: fits once more without
/// reflection, and returns that result, with handednessOpen and the misfit of `found`, if it is within 1 % of
/// the score or better. Any other result comes back as it is. Errors: as `fit`.
[[nodiscard]] Result<FitResult> preferUnmirrored(FitResult found, const FitQuery& query,
                                                 const SurfacePoints& other, const FitOptions& options,
                                                 const RunContext& context = {});

/// `fit` and `preferUnmirrored`: what a user is shown. Errors: as `fit`.
[[nodiscard]] Result<FitResult> align(const FitQuery& query, const SurfacePoints& other,
                                      const FitOptions& options = {}, const RunContext& context = {});

}  // namespace shapedb
