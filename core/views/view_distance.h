// SPDX-License-Identifier: GPL-3.0-or-later
// How far a scan of one side is from the views of a shape, exactly and by a cheap lower bound.
//
// All functions are pure and thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/views/view_signature.h"
#include "core/views/views.h"

namespace shapedb {

struct ViewOptions {
    bool reflection = true;  ///< a mirrored shape is as good
    bool keepScale = false;  ///< both have the same unit of length: sizes count
    bool sideKnown = false;  ///< the query was made with the direction to the viewer
};

/// The sums of levels that no flip of a view changes: of each ring of cells that flips exchange, 0 to 180,
/// and the levels of the distances.
constexpr std::size_t kCoarseRings = (kViewColumns / 2) * ((kViewRows + 1) / 2);
struct CoarseView {
    std::array<std::uint8_t, kCoarseRings> rings{};
    std::array<std::uint8_t, kViewDistances / 2> distances{};  ///< two levels a byte, as in ViewSignature
};
[[nodiscard]] CoarseView coarseView(const ViewSignature& view);

/// The views of a shape with their coarse forms, as a search keeps them: 1,680 bytes.
struct ShapeViews {
    explicit ShapeViews(const ViewSet& set);

    ViewSet set;
    std::array<CoarseView, kViews> coarse;
};

/// A query made ready once for any number of comparisons. Immutable.
class ViewQuery {
  public:
    explicit ViewQuery(const ViewSignature& view, const ViewOptions& options = {});

    /// The least distance over the ways of laying the query's frame on the view's: the sum of differences of
    /// levels, those of the distances kDistanceWeight times. With keepScale 1 is added for each
    /// 1/kSizeWeight of an octave between the sizes, up to kMostForSize. 0 for a view and itself; unrelated
    /// shapes typically have 100 to 200.
    [[nodiscard]] std::uint32_t distance(const ViewSignature& view) const;

    /// Never above `distance` of the view that `coarse` is of.
    [[nodiscard]] std::uint32_t bound(const CoarseView& coarse) const;

    /// The least distance over all views of a shape.
    [[nodiscard]] std::uint32_t distance(const ViewSet& set) const;

    /// The same where it is at most `most`; otherwise any value above `most`, sooner.
    [[nodiscard]] std::uint32_t distance(const ShapeViews& shape, std::uint32_t most) const;

  private:
    // Levels one a byte: those of the low halves, then those of the high halves.
    using Unpacked = std::array<std::uint8_t, 2 * kViewBytes>;
    std::vector<Unpacked> turns_;
    CoarseView coarse_;
    double octaves_ = 0.0;  // log2 of the size
    bool keepScale_ = false;
};

/// How much more a level of the distances counts than one of the cells.
constexpr std::uint32_t kDistanceWeight = 3;
constexpr double kSizeWeight = 100.0;
constexpr std::uint32_t kMostForSize = 300;

}  // namespace shapedb
