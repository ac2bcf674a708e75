// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/evaluation/metrics.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

// By falling score, ties by rising index.
void sortByScore(std::vector<std::size_t>& order, const double* scores) {
    std::sort(order.begin(), order.end(), [scores](std::size_t a, std::size_t b) {
        return scores[a] != scores[b] ? scores[a] > scores[b] : a < b;
    });
}

// Gain of a right candidate at a rank counted from 1.
double discount(std::size_t rank) { return rank == 1 ? 1.0 : 1.0 / std::log2(static_cast<double>(rank)); }

// `relevant` > 0 is the number of right candidates, all of which are somewhere in `order`.
template <typename IsRight>
RetrievalMetrics measure(const std::vector<std::size_t>& order, std::size_t relevant, IsRight isRight) {
    RetrievalMetrics metrics;
    const auto wanted = static_cast<double>(relevant);
    double ideal = 0.0;
    for (std::size_t rank = 1; rank <= relevant; ++rank) ideal += discount(rank);
    std::size_t found = 0;
    for (std::size_t rank = 1; rank <= order.size(); ++rank) {
        if (!isRight(order[rank - 1])) continue;
        ++found;
        if (rank == 1) metrics.nearestNeighbour = 1.0;
        if (rank <= relevant) metrics.firstTier += 1.0 / wanted;
        if (rank <= 2 * relevant) metrics.secondTier += 1.0 / wanted;
        metrics.dcg += discount(rank) / ideal;
        metrics.averagePrecision += static_cast<double>(found) / static_cast<double>(rank) / wanted;
    }
    return metrics;
}

void add(RetrievalMetrics& sum, const RetrievalMetrics& one) {
    sum.nearestNeighbour += one.nearestNeighbour;
    sum.firstTier += one.firstTier;
    sum.secondTier += one.secondTier;
    sum.dcg += one.dcg;
    sum.averagePrecision += one.averagePrecision;
}

void divide(RetrievalMetrics& sum, std::size_t count) {
    if (count == 0) return;
    const auto n = static_cast<double>(count);
    sum.nearestNeighbour /= n;
    sum.firstTier /= n;
    sum.secondTier /= n;
    sum.dcg /= n;
    sum.averagePrecision /= n;
}

Result<void> checkGalleryQuery(const GalleryQuery& query, std::size_t number, std::size_t gallerySize) {
    const std::string where = "query " + std::to_string(number) + ": ";
    std::vector<bool> seen(gallerySize, false);
    for (const std::size_t entry : query.ranking) {
        if (entry >= gallerySize || seen[entry]) {
            return fail(ErrorCode::kInvalidArgument,
                        where + "its ranking names entry " + std::to_string(entry) +
                            (entry >= gallerySize ? " of a gallery of " + std::to_string(gallerySize)
                                                  : std::string(" twice")));
        }
        seen[entry] = true;
    }
    for (const std::size_t entry : query.right) {
        if (entry >= gallerySize) {
            return fail(ErrorCode::kInvalidArgument, where + "its right answer " + std::to_string(entry) +
                                                         " is not in the gallery of " +
                                                         std::to_string(gallerySize));
        }
    }
    return {};
}

// From 1; 0 when no right entry is ranked.
std::size_t firstRightRank(const GalleryQuery& query) {
    const auto at = std::find_if(query.ranking.begin(), query.ranking.end(), [&](std::size_t entry) {
        return std::find(query.right.begin(), query.right.end(), entry) != query.right.end();
    });
    if (at == query.ranking.end()) return 0;
    return static_cast<std::size_t>(at - query.ranking.begin()) + 1;
}

}  // namespace

Result<void> checkScoreMatrix(const ScoreMatrix& scores, std::size_t count) {
    if (count == 0) return fail(ErrorCode::kInvalidArgument, "there are no shapes to evaluate");
    if (scores.size() / count != count || scores.size() % count != 0) {
        return fail(ErrorCode::kInvalidArgument, "the score matrix has " + std::to_string(scores.size()) +
                                                     " entries, but " + std::to_string(count) +
                                                     " labels need the square of their number");
    }
    for (std::size_t i = 0; i < scores.size(); ++i) {
        if (std::isnan(scores[i]) && i / count != i % count) {
            return fail(ErrorCode::kInvalidArgument, "the score of query " + std::to_string(i / count) +
                                                         " against candidate " + std::to_string(i % count) +
                                                         " is not a number");
        }
    }
    return {};
}

std::vector<std::size_t> rankOthers(const ScoreMatrix& scores, std::size_t count, std::size_t query) {
    std::vector<std::size_t> order;
    order.reserve(count - 1);
    for (std::size_t i = 0; i < count; ++i) {
        if (i != query) order.push_back(i);
    }
    sortByScore(order, scores.data() + query * count);
    return order;
}

Result<RetrievalReport> evaluateLeaveOneOut(const ScoreMatrix& scores,
                                            const std::vector<std::string>& labels) {
    const std::size_t count = labels.size();
    RETURN_IF_ERROR(checkScoreMatrix(scores, count));
    std::map<std::string, std::size_t> members;
    for (const std::string& label : labels) ++members[label];

    RetrievalReport report;
    report.perQuery.resize(count);
    std::map<std::string, ClassMetrics> perClass;
    for (std::size_t query = 0; query < count; ++query) {
        ClassMetrics& own = perClass[labels[query]];
        own.name = labels[query];
        const std::size_t relevant = members[labels[query]] - 1;
        if (relevant == 0) {
            ++report.lonely;
            continue;
        }
        const auto isRight = [&](std::size_t candidate) { return labels[candidate] == labels[query]; };
        report.perQuery[query] = measure(rankOthers(scores, count, query), relevant, isRight);
        ++report.queries;
        ++own.queries;
        add(report.mean, report.perQuery[query]);
        add(own.mean, report.perQuery[query]);
    }
    divide(report.mean, report.queries);
    for (auto& [name, metrics] : perClass) {
        divide(metrics.mean, metrics.queries);
        report.perClass.push_back(std::move(metrics));
    }
    return report;
}

Result<GalleryReport> evaluateGallery(const std::vector<GalleryQuery>& queries, std::size_t gallerySize) {
    GalleryReport report;
    report.firstRightRank.reserve(queries.size());
    for (std::size_t q = 0; q < queries.size(); ++q) {
        RETURN_IF_ERROR(checkGalleryQuery(queries[q], q, gallerySize));
        const std::size_t rank = firstRightRank(queries[q]);
        report.firstRightRank.push_back(rank);
        if (queries[q].right.empty()) {
            ++report.withoutRightAnswer;
            continue;
        }
        ++report.queries;
        if (rank == 0) continue;
        report.hitAt1 += rank == 1 ? 1.0 : 0.0;
        report.hitAt5 += rank <= 5 ? 1.0 : 0.0;
        report.meanReciprocalRank += 1.0 / static_cast<double>(rank);
    }
    if (report.queries > 0) {
        const auto n = static_cast<double>(report.queries);
        report.hitAt1 /= n;
        report.hitAt5 /= n;
        report.meanReciprocalRank /= n;
    }
    return report;
}

}  // namespace shapedb
