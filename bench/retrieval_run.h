// SPDX-License-Identifier: GPL-3.0-or-later
// The work of `shapedb-bench retrieval`: every method gets the same points and the same queries.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/method.h"
#include "client/cli/retrieval_task.h"
#include "client/cli/scan_source.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/evaluation/metrics.h"

namespace shapedb::bench {

using cli::RetrievalTask;

struct RetrievalSettings {
    cli::ScanFlags scan;                ///< its noise is not used
    std::vector<double> noise = {0.0};  ///< levels, shares of the bounding-box diagonal
    /// Rotates every scan at random before any method sees it, so that none profits from models that
    /// are stored upright.
    bool rotate = true;
    unsigned threads = 1;  ///< at least 1; each measurement uses one
};

/// A scan that a method could not describe; it matches nothing and ranks last.
struct ScanFailure {
    std::string path;
    Error error;
    bool unreadable = false;  ///< no method could read it
};

/// The result of one query against a gallery.
struct QueryResult {
    std::string query;     ///< name
    std::size_t rank = 0;  ///< of the first right entry, from 1; 0: none, or not ranked
    std::string firstHit;  ///< name of the first entry; empty when nothing was ranked
    double score = 0.0;    ///< of the first entry
};

struct MethodResult {
    std::string name, title, comparison;  ///< of the method
    RetrievalMetrics metrics;             ///< leave-one-out
    std::vector<double> precision;        ///< leave-one-out: see precisionAtRecall
    GalleryReport gallery;                ///< gallery
    std::vector<QueryResult> queries;     ///< gallery
    std::vector<ScanFailure> failures;
    double secondsPerShape = 0.0;  ///< to describe one, processor time of one thread
    double secondsPerPair = 0.0;   ///< to compare two
};

struct LevelResult {
    double noise = 0.0;
    std::vector<MethodResult> methods;
};

/// `progress(what, done, total)` may be called from any thread.
using Progress = std::function<void(const std::string& what, std::size_t done, std::size_t total)>;

/// Results by noise level in the order given, methods in the order given. Deterministic except
/// for times and for ESF, which PCL seeds from the clock.
///
/// Noise is added first, exactly as `shapedb evaluate` adds it, then the subset is taken, then the
/// scan is turned. With a gallery, noise and subset apply to the queries only: the gallery is what a
/// user has stored.
///
/// Errors: kInvalidArgument (--points), kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<std::vector<LevelResult>> runRetrieval(const RetrievalTask& task,
                                                            const RetrievalSettings& settings,
                                                            const std::vector<Method>& methods,
                                                            const Progress& progress,
                                                            const RunContext& context);

// The precision-recall curve of leave-one-out retrieval.

/// Recall levels 1/20, 2/20 .. 1.
inline constexpr std::size_t kRecallLevels = 20;

/// The mean over all queries of the interpolated precision at each recall level: the best precision
/// at any rank where at least that share of the right candidates has been found. In [0, 1],
/// never rising. Right means the same label; a shape alone in its class is no query; ties break by index.
/// All 0 without queries.
///
/// Errors: those of `checkScoreMatrix`.
[[nodiscard]] Result<std::vector<double>> precisionAtRecall(const ScoreMatrix& scores,
                                                            const std::vector<std::string>& labels);

}  // namespace shapedb::bench
