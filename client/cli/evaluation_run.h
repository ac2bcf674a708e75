// The work behind `shapedb evaluate`: a collection of files to signatures, signatures to scores,
// both in parallel and with the same result for any number of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/scan_source.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/evaluation/metrics.h"
#include "core/matching/score.h"
#include "core/signature/profile.h"

namespace shapedb::cli {

struct EvaluatedShape {
    std::string path;   ///< as found
    std::string name;   ///< relative to the folder it was found in; decides its seed
    std::string label;  ///< name of the folder that holds the file
    /// Set exactly when `failure` is not. A shape without one scores 0 against everything.
    std::optional<Signature> signature;
    std::optional<Error> failure;
    double seconds = 0.0;  ///< reading, noise and segmentation together
};

/// One a processor this program may use.
[[nodiscard]] unsigned defaultThreads();

/// Every scan file under each root, in the order of the roots and, within one, of the paths.
/// Errors: those of listScanFiles.
[[nodiscard]] Result<std::vector<EvaluatedShape>> listShapes(const std::vector<std::string>& roots);

/// Fills in `signature` or `failure` of each shape; noise and subset come from
/// fileSeed(flags.seed, name). Files are taken by `threads` threads, at least 1.
/// A file that cannot be read or segmented is a `failure`, not an error.
///
/// Errors: kCancelled, kDeadlineExceeded; kInvalidArgument (flags).
[[nodiscard]] Result<void> describeShapes(std::vector<EvaluatedShape>& shapes, const ScanFlags& flags,
                                          const ShapeParameters& parameters, unsigned threads,
                                          const std::function<void(std::size_t done)>& progress,
                                          const RunContext& context);

/// Row-major scores of `rows` x `columns`. Passing the same vector twice scores each pair once:
/// a score is symmetric bit for bit. Shapes without a signature score 0.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<ScoreMatrix> scorePairs(const std::vector<EvaluatedShape>& rows,
                                             const std::vector<EvaluatedShape>& columns,
                                             const ScoreOptions& options, unsigned threads,
                                             const std::function<void(std::size_t rowsDone)>& progress,
                                             const RunContext& context);

}  // namespace shapedb::cli
