// How good a ranking is: the retrieval measures of the Princeton Shape Benchmark and of the
// SHREC contests over a score matrix, and hit rates of queries against a separate gallery.
//
// Formulas and sources: docs/evaluation.md. All functions are pure and may be called from any
// number of threads at once; none allocates more than a few times the size of its input.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb {

/// Scores of n shapes against each other, row-major: `values[query * n + candidate]`, where n is
/// the number of labels given beside it. Higher is better; any finite or infinite value is
/// allowed, NaN is not. The matrix need not be symmetric.
using ScoreMatrix = std::vector<double>;

/// The candidates by falling score, ties by rising index: the one ranking rule of this folder.
///
/// Errors: kInvalidArgument when a score is NaN (the message names its index).
[[nodiscard]] Result<std::vector<std::size_t>> rankByScore(const std::vector<double>& scores);

/// Whether `scores` is a score matrix of `count` shapes.
///
/// Errors: kInvalidArgument when its size is not the square of `count`, when `count` is 0, or when
/// a score off the diagonal is NaN (the message names query and candidate). The diagonal, a shape
/// against itself, is never read.
[[nodiscard]] Result<void> checkScoreMatrix(const ScoreMatrix& scores, std::size_t count);

/// All shapes but `query` in the order of their scores for it. `scores` must have passed
/// `checkScoreMatrix` and `query` be below `count`.
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
    std::size_t queries = 0;  ///< members of the class; 0 for a class of one, which asks no query
    RetrievalMetrics mean;    ///< all 0 when `queries` is 0
};

struct RetrievalReport {
    std::size_t queries = 0;  ///< shapes that asked a query: all but the `lonely`
    std::size_t lonely = 0;   ///< shapes alone in their class: nothing to find, so no query,
                              ///< but still candidates in the queries of others
    RetrievalMetrics mean;    ///< over all queries alike, so large classes weigh more; 0 without queries
    std::vector<ClassMetrics> perClass;      ///< by name, every class that occurs
    std::vector<RetrievalMetrics> perQuery;  ///< by shape index; all 0 for the lonely
};

/// Leave-one-out retrieval: every shape with a companion queries all others (itself excluded),
/// and a candidate is right when it has the same label.
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
    std::size_t queries = 0;  ///< queries with a right answer in the gallery: the base of the means
    std::size_t withoutRightAnswer = 0;  ///< the others, in no mean
    double hitAt1 = 0.0;                 ///< share of queries with a right entry first; 0 without queries
    double hitAt5 = 0.0;                 ///< the same among the first five
    double meanReciprocalRank = 0.0;     ///< mean of 1 / rank of the first right entry, 0 when unranked
    /// By query: the rank, from 1, of the first right entry; 0 when no right entry was ranked or
    /// there is none.
    std::vector<std::size_t> firstRightRank;
};

/// Ranks against a gallery of `gallerySize` entries.
///
/// Errors: kInvalidArgument when an index is at or above `gallerySize`, or a ranking names an
/// entry twice (the message names the query and the index).
[[nodiscard]] Result<GalleryReport> evaluateGallery(const std::vector<GalleryQuery>& queries,
                                                    std::size_t gallerySize);

}  // namespace shapedb
