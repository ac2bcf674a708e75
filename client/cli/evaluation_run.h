// The work behind `shapedb evaluate`: a collection of files to signatures, signatures to scores,
// both in parallel and with the same result for any number of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/retrieval_task.h"
#include "client/cli/scan_source.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/evaluation/metrics.h"
#include "core/matching/score.h"
#include "core/pipeline.h"

namespace shapedb::cli {

struct EvaluatedShape : CollectionScan {
    /// Set exactly when `failure` is not. A shape without one scores 0 against everything.
    std::optional<Signature> signature;
    std::optional<Error> failure;
    double seconds = 0.0;  ///< reading, noise and segmentation together
};

/// One a processor this program may use.
[[nodiscard]] unsigned defaultThreads();

/// Runs body(i) for all i below `count` on `threads` threads, at least 1; items are handed out one
/// at a time because their costs differ widely. An error that the body returns ends the run and is
/// its result (with several threads, one of those returned).
///
/// Errors: that of the body; kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<void> forEachItem(std::size_t count, unsigned threads, const RunContext& context,
                                       const std::function<std::optional<Error>(std::size_t)>& body);

/// The scans, nothing computed yet.
[[nodiscard]] std::vector<EvaluatedShape> shapesOf(const std::vector<CollectionScan>& scans);

/// Fills in `signature` or `failure` of each shape; noise and subset come from
/// fileSeed(flags.seed, name). Files are taken by `threads` threads, at least 1.
/// A file that cannot be read or segmented is a `failure`, not an error.
///
/// Errors: kCancelled, kDeadlineExceeded; kInvalidArgument (flags).
[[nodiscard]] Result<void> describeShapes(std::vector<EvaluatedShape>& shapes, const ScanFlags& flags,
                                          const ShapeParameters& parameters, unsigned threads,
                                          const std::function<void(std::size_t done)>& progress,
                                          const RunContext& context);

/// Row-major scores of `rows` x `columns`. Passing the same vector twice scores each pair once,
/// because a score is symmetric bit for bit, unless it is partial: of the row in the column. Shapes without a
/// signature score 0.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<ScoreMatrix> scorePairs(const std::vector<EvaluatedShape>& rows,
                                             const std::vector<EvaluatedShape>& columns,
                                             const ScoreOptions& options, unsigned threads,
                                             const std::function<void(std::size_t rowsDone)>& progress,
                                             const RunContext& context);

}  // namespace shapedb::cli
