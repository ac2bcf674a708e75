// SPDX-License-Identifier: GPL-3.0-or-later
// The work behind `shapedb evaluate`: files to signatures to scores, in parallel, with the same result for
// any number of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/retrieval_task.h"
#include "client/cli/scan_source.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/evaluation/metrics.h"
#include "core/fit/surface_points.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/search/verify.h"
#include "core/views/view_distance.h"

namespace shapedb::cli {

struct EvaluatedShape : CollectionScan {
    /// Set unless `failure` is. A shape without a signature scores 0 against everything.
    std::optional<Signature> signature;
    std::shared_ptr<const SurfacePoints> surface;  ///< with the signature, if asked for
    std::shared_ptr<const ShapeViews> views;       ///< likewise
    std::optional<Error> failure;
    double seconds = 0.0;  ///< for reading, noise and segmentation together
};

/// One per processor that this program may use.
[[nodiscard]] unsigned defaultThreads();

/// Runs body(i) for all i below `count` on `threads` threads, at least 1. Items are handed out one at a time,
/// because their costs differ widely. An error from the body ends the run and is its result (if there are
/// several, one of them).
///
/// Errors: that of the body; kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<void> forEachItem(std::size_t count, unsigned threads, const RunContext& context,
                                       const std::function<std::optional<Error>(std::size_t)>& body);

/// Shapes with nothing computed yet.
[[nodiscard]] std::vector<EvaluatedShape> shapesOf(const std::vector<CollectionScan>& scans);

/// Sets `signature` (`withSurface`: and `surface` and `views`) or `failure` of each shape, on `threads`
/// threads, at least 1. Noise and subset are seeded with fileSeed(flags.seed, name). A file that cannot be
/// read or segmented is a `failure`, not an error.
///
/// Errors: kCancelled, kDeadlineExceeded; kInvalidArgument (flags).
[[nodiscard]] Result<void> describeShapes(std::vector<EvaluatedShape>& shapes, const ScanFlags& flags,
                                          const ShapeParameters& parameters, bool withSurface,
                                          unsigned threads,
                                          const std::function<void(std::size_t done)>& progress,
                                          const RunContext& context);

/// Row-major scores of `rows` x `columns`; a partial score says how much of the row the column contains. If
/// both are the same vector each pair is scored once, as scores are symmetric bit for bit unless partial.
/// Shapes without a signature score 0.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<ScoreMatrix> scorePairs(const std::vector<EvaluatedShape>& rows,
                                             const std::vector<EvaluatedShape>& columns,
                                             const ScoreOptions& options, unsigned threads,
                                             const std::function<void(std::size_t rowsDone)>& progress,
                                             const RunContext& context);

/// The same as a verified search ranks them (core/search/verify.h): each row is a query, without itself among
/// the candidates if both are the same vector (its own score is 1 then). Needs surfaces.
///
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory; kInvalidArgument (options).
[[nodiscard]] Result<ScoreMatrix> verifyPairs(const std::vector<EvaluatedShape>& rows,
                                              const std::vector<EvaluatedShape>& columns,
                                              const ScoreOptions& options, const VerifyOptions& verify,
                                              unsigned threads,
                                              const std::function<void(std::size_t rowsDone)>& progress,
                                              const RunContext& context);

}  // namespace shapedb::cli
