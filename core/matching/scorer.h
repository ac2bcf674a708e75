// How alike a query is to other shapes (Section 4.2 of the paper): one interface, one folder for each method.
//
//   published/   points and weights alone, as in the paper
//   attributed/  also what the segments and the shapes as a whole are like (the default profile)
//
// A method is a class derived from Scorer; `makeScorer` is the only place that chooses one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/matching/explanation.h"
#include "core/matching/score_options.h"
#include "core/matching/shape_row.h"
#include "core/signature/signature.h"

namespace shapedb {

/// A row that a scan could not rule out.
struct Survivor {
    /// What a scan found out about a row, for the scorer itself in `scoreIfReaches`: whole numbers, so that
    /// nothing is computed in a scan that only the few rows need that are scored in the end.
    using Known = std::array<std::uint16_t, 10>;

    double bound = 0.0;  ///< its score is no larger
    std::uint32_t row = 0;
    Known known{};
};

/// How many rows each stage of a scan left to the next.
struct ScanCounts {
    std::uint64_t afterFirstHalf = 0;
    std::uint64_t afterStatistics = 0;
};

/// Scores shapes against one query. Immutable: all members may be called from any thread. Only `scan`
/// (once a call) and `explain` allocate.
class Scorer {
  public:
    Scorer() = default;
    Scorer(const Scorer&) = delete;
    Scorer& operator=(const Scorer&) = delete;
    virtual ~Scorer() = default;

    /// Whether the shape has what this scorer reads. No other member may be given one that has not;
    /// `scan` leaves such rows out.
    [[nodiscard]] virtual bool compares(const ShapeRow& shape) const = 0;

    /// In [0, 1]; 1 for the same shape.
    [[nodiscard]] virtual double score(const ShapeRow& shape) const = 0;

    /// Never below `score`, at most 1, and much cheaper.
    [[nodiscard]] virtual double bound(const ShapeRow& shape) const = 0;

    /// `score` with its reasons, bit for bit: the query is a, `shape` is b.
    [[nodiscard]] virtual Explanation explain(const Signature& shape) const = 0;

    /// Appends to `left`, in ascending order, every row that may score `least` or more. `wanted` has one
    /// value a row, 0 leaves it out; empty: all rows. By default asks each row for its `bound`;
    /// scorers with bounds for many rows at once override it.
    virtual void scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
                      std::vector<Survivor>& left, ScanCounts& counts) const;

    /// The score of a row that `scan` left, or nothing where a closer bound shows that it is below
    /// `least`. `shape` is that row, `survivor` what the scan said of it. By default `score`.
    [[nodiscard]] virtual std::optional<double> scoreIfReaches(const ShapeRow& shape,
                                                               const Survivor& survivor, double least) const;

    /// As above for a signature with all its points.
    [[nodiscard]] double score(const Signature& shape) const { return score(PackedShape(shape).row()); }
    [[nodiscard]] double bound(const Signature& shape) const { return bound(PackedShape(shape).row()); }
};

/// The scorer of a query: with attributes it compares these where the other shape has them too, and
/// points and weights otherwise. Keeps a copy of what it needs. `query` and `options` must be valid.
[[nodiscard]] std::unique_ptr<const Scorer> makeScorer(const Signature& query, const ScoreOptions& options);

}  // namespace shapedb
