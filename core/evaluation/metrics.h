// SPDX-License-Identifier: GPL-3.0-or-later
// How good a ranking is: the retrieval measures of the Princeton Shape Benchmark and of the SHREC contests
// over a score matrix, and hit rates of queries against a separate gallery.
//
// Formulas and sources: docs/evaluation.md. All functions are pure and thread-safe; none allocates more
// than a few times the size of its input.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb {

/// Scores of n shapes against each other, row-major: `values[query * n + candidate]`, where n is the
/// number of labels. Higher is better. Infinite values are allowed, NaN is not. Need not be symmetric.
/// Candidates are ranked by descending score, ties by ascending index.
using ScoreMatrix = std::vector<double>;

/// Whether `scores` is a score matrix of `count` shapes.
///
/// Errors: kInvalidArgument when `count` is 0, the size is not the square of `count`, or a score off the
/// diagonal is NaN (the message names query and candidate). The diagonal is never read.
[[nodiscard]] Result<void> checkScoreMatrix(const ScoreMatrix& scores, std::size_t count);

/// All shapes but `query`, ranked by their scores for it. `scores` must have passed `checkScoreMatrix`;
/// `query` must be below `count`.
[[nodiscard]] std::vector<std::size_t> rankOthers(const ScoreMatrix& scores, std::size_t count,
                                                  std::size_t query);

/// The five measures, each in [0, 1], higher is better; for one query or a mean over queries.
struct RetrievalMetrics {
    double nearestNeighbour = 0.0;  ///< the first candidate is of the query's class
    double firstTier = 0.0;         ///< recall among the first R, R = other members of the class
    double secondTier = 0.0;        ///< recall among the first 2 R
    double dcg = 0.0;               ///< discounted cumulative gain over that of the ideal ranking
    double averagePrecision = 0.0;  ///< mean precision at the ranks of the right candidates
};

/// The mean over the queries of one class.
struct ClassMetrics {
    std::string name;
    std::size_t queries = 0;  ///< members of the class; 0 for a class of one
    RetrievalMetrics mean;    ///< all 0 when `queries` is 0
};

struct RetrievalReport {
    std::size_t queries = 0;  ///< all shapes but the `lonely`
    std::size_t lonely =
        0;                  ///< alone in their class: no queries, as there is nothing to find, but candidates
    RetrievalMetrics mean;  ///< over all queries, so large classes weigh more; 0 without queries
    std::vector<ClassMetrics> perClass;      ///< by name, every class that occurs
    std::vector<RetrievalMetrics> perQuery;  ///< by shape index; all 0 for the lonely
};

/// Leave-one-out retrieval: every shape that is not alone in its class queries all others, and a candidate
/// is right when it has the same label.
///
/// Errors: those of `checkScoreMatrix` for `labels.size()` shapes.
[[nodiscard]] Result<RetrievalReport> evaluateLeaveOneOut(const ScoreMatrix& scores,
                                                          const std::vector<std::string>& labels);

/// One query against a gallery it is not part of.
struct GalleryQuery {
    std::vector<std::size_t> ranking;  ///< gallery indices, best first; may stop early (top k only)
    std::vector<std::size_t> right;    ///< gallery indices that count as right; empty: no right answer
};

struct GalleryReport {
    std::size_t queries = 0;             ///< with a right answer in the gallery; the means are over these
    std::size_t withoutRightAnswer = 0;  ///< the others
    double hitAt1 = 0.0;                 ///< share of queries with a right entry first; 0 without queries
    double hitAt5 = 0.0;                 ///< the same among the first five
    double meanReciprocalRank = 0.0;     ///< mean of 1 / rank of the first right entry, 0 when unranked
    /// By query: the rank, from 1, of the first right entry; 0 when none was ranked.
    std::vector<std::size_t> firstRightRank;
};

/// Ranks against a gallery of `gallerySize` entries.
///
/// Errors: kInvalidArgument when an index is not below `gallerySize` or a ranking names an entry twice (the
/// message names query and index).
[[nodiscard]] Result<GalleryReport> evaluateGallery(const std::vector<GalleryQuery>& queries,
                                                    std::size_t gallerySize);

}  // namespace shapedb
