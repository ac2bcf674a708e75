// SPDX-License-Identifier: Apache-2.0
// Writes points to PLY files that any viewer opens.
//
// A regular file is written under a temporary name and then renamed: readers never see half a file, and a
// failure leaves an existing one alone. Anything else under that name (a pipe, a device) is written to
// directly.
//
// Thread-safety: all functions may be called from any number of threads at once.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// A colour, each part 0 to 255.
struct Rgb {
    std::uint8_t red = 0;
    std::uint8_t green = 0;
    std::uint8_t blue = 0;
};

/// The colour of a segment, always the same for the same label. 0 to 17 are hand-picked to be easy to tell
/// apart; from 18 on hues step by the golden angle in three shades. The first 300 labels all differ. Negative
/// labels are grey, which no segment is.
[[nodiscard]] Rgb segmentColour(std::int32_t label);

/// Writes binary little-endian PLY with the vertex properties x y z, uchar red green blue (segmentColour) and
/// int segment (the label). Coordinates are float, or double for points so far from the origin that single
/// precision would cost them digits (isFarFromOrigin). `labels` has one entry per point, -1 for none.
///
/// Errors: kInvalidArgument (not as many labels as points); kNonFiniteCoordinate and kCoordinateOutOfRange
/// (beyond single precision), naming the point; kFileNotWritable; kOutOfMemory. An error leaves no new file
/// behind.
[[nodiscard]] Result<void> writeLabelledPly(const std::string& path, const PointCloud& points,
                                            const std::vector<std::int32_t>& labels);

/// How coordinates are stored.
enum class PlyPrecision { kSingle, kDouble };

/// Writes binary little-endian PLY with the vertex properties x y z, float or double. Errors as above.
[[nodiscard]] Result<void> writePointsPly(const std::string& path, const PointCloud& points,
                                          PlyPrecision precision = PlyPrecision::kSingle);

}  // namespace shapedb
