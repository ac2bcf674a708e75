// SPDX-License-Identifier: GPL-3.0-or-later
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
#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "core/base/error.h"
#include "core/matching/explanation.h"
#include "core/matching/score.h"
#include "core/matching/shape_row.h"
#include "core/signature/signature.h"
#include "core/signature/statistics.h"

namespace shapedb {

/// Intermediate results of a scan for one row, handed on to `scoreIfReaches`. Only the scorer that wrote them
/// knows what they are: any value of at most kMostBytes that may be copied as bytes.
class Findings {
  public:
    /// The largest: the level sums of scorers with attributes, 16 bits for each statistic.
    static constexpr std::size_t kMostBytes = kStatisticKinds * sizeof(std::uint16_t);

    Findings() = default;
    template <typename T>
    explicit Findings(const T& value) {
        requireFits<T>();
        std::memcpy(bytes_.data(), &value, sizeof(T));
    }

    /// `T` as it was written.
    template <typename T>
    [[nodiscard]] T as() const {
        requireFits<T>();
        T value;
        std::memcpy(&value, bytes_.data(), sizeof(T));
        return value;
    }

  private:
    template <typename T>
    static constexpr void requireFits() {
        static_assert(std::is_trivially_copyable_v<T>, "findings are copied as bytes");
        static_assert(sizeof(T) <= kMostBytes,
                      "these findings are the largest of all scorers: kMostBytes has to be their size, which "
                      "every survivor of a scan then takes");
    }

    std::array<std::byte, kMostBytes> bytes_{};
};

/// A row that a scan could not rule out.
struct Survivor {
    double bound = 0.0;  ///< its score is no larger
    std::uint32_t row = 0;
    Findings findings;
};

/// How many rows each stage of a scan left to the next. Each scorer names its own stages; one that it
/// does not have leaves all rows that it compares.
struct ScanCounts {
    static constexpr std::size_t kMostStages = 2;
    std::array<std::uint64_t, kMostStages> left{};

    ScanCounts& operator+=(const ScanCounts& other) {
        for (std::size_t stage = 0; stage < kMostStages; ++stage) left[stage] += other.left[stage];
        return *this;
    }
};

/// Scores shapes against one query: made once, it serves a whole search and the explanations of its hits.
/// Immutable: all members may be called from any thread. Only `scan` (once a call) and `explain` allocate.
class Scorer {
  public:
    Scorer() = default;
    Scorer(const Scorer&) = delete;
    Scorer& operator=(const Scorer&) = delete;
    virtual ~Scorer() = default;

    /// Whether the shape has what this scorer reads. Pass only such shapes to the other members; `scan`
    /// leaves other rows out.
    [[nodiscard]] virtual bool compares(const ShapeRow& shape) const = 0;

    /// In [0, 1]; 1 for the same shape.
    [[nodiscard]] virtual double score(const ShapeRow& shape) const = 0;

    /// Never below `score`, at most 1, and much cheaper.
    [[nodiscard]] virtual double bound(const ShapeRow& shape) const = 0;

    /// `score` with its reasons, bit for bit: the query is a, `shape` is b, which must have its points and
    /// its placement, as the row of a PackedShape has.
    [[nodiscard]] virtual Explanation explain(const ShapeRow& shape) const = 0;

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
    [[nodiscard]] Explanation explain(const Signature& shape) const {
        return explain(PackedShape(shape).row());
    }
};

/// Whether a query can be searched for among shapes of which `attributed` have attributes. Errors:
/// kInvalidArgument (it has points and weights alone, they have more).
[[nodiscard]] Result<void> checkQuery(const Signature& query, std::size_t attributed);

/// The scorer of a query: with attributes it compares these where the other shape has them too, and
/// points and weights otherwise. Keeps a copy of what it needs. `query` and `options` must be valid.
[[nodiscard]] std::unique_ptr<const Scorer> makeScorer(const Signature& query, const ScoreOptions& options);

}  // namespace shapedb
