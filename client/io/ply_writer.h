// Points out to PLY files any viewer opens.
//
// A regular file is written under a temporary name beside its place and then renamed, so that a
// reader never meets half a file and a failure leaves an old one as it was. Anything else that
// exists under the name (a pipe, a device) is written to directly.
//
// Thread-safety: all functions may be called from any number of threads at once.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// A colour of a screen, each part 0 to 255.
struct Rgb {
    std::uint8_t red = 0;
    std::uint8_t green = 0;
    std::uint8_t blue = 0;
};

/// The colour a segment is drawn in, always the same for the same label. 0 to 17 are picked by
/// hand to be told apart at a glance; from 18 on hues turn by the golden angle in three shades,
/// less far apart; the first 300 labels all differ. Negative: grey, which no segment has.
[[nodiscard]] Rgb segmentColour(std::int32_t label);

/// Writes binary little-endian PLY with the vertex properties float x y z, uchar red green blue
/// (segmentColour) and int segment (the label). `labels` has one entry per point, -1 for none.
///
/// Errors: kInvalidArgument when there are not as many labels as points; kNonFiniteCoordinate or
/// kCoordinateOutOfRange when a coordinate is not finite or beyond single precision (the message
/// names the point); kFileNotWritable when the file cannot be created or written in full;
/// kOutOfMemory. On error nothing is left under the name that was not there before.
[[nodiscard]] Result<void> writeLabelledPly(const std::string& path, const PointCloud& points,
                                            const std::vector<std::int32_t>& labels);

/// Writes binary little-endian PLY with the vertex properties float x y z. Errors as above.
[[nodiscard]] Result<void> writePointsPly(const std::string& path, const PointCloud& points);

}  // namespace shapedb
