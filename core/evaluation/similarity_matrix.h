// SPDX-License-Identifier: GPL-3.0-or-later
// The similarity matrix as a picture, as in Figure 6 of Dey and Goswami (2004). Rows are queries and columns
// candidates, both grouped by class; in each row the few best scores are shaded by their value. Good
// retrieval shows as dark blocks along the diagonal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/evaluation/metrics.h"

namespace shapedb {

struct SimilarityMatrixOptions {
    std::size_t shadedPerQuery = 5;  ///< best candidates shaded per row (paper: five); at least 1
    std::size_t cellPixels = 4;      ///< side of one cell in pixels, 1 to 64
    bool colourWrongClass = true;    ///< shade candidates of another class red instead of grey
};

/// The rows (and columns) of one class in the raster.
struct ClassBand {
    std::string name;
    std::size_t firstPixel = 0;  ///< first pixel row of the class's first query
    std::size_t pixels = 0;      ///< height of the band: members * cellPixels
};

/// A square raster without labels: a class has the same band in both directions. Lines between classes and
/// around the border are one pixel wide, in kClassLineGrey.
struct SimilarityRaster {
    std::size_t width = 0;            ///< pixels
    std::size_t height = 0;           ///< pixels
    std::vector<std::uint8_t> rgb;    ///< 3 * width * height bytes, rows from the top
    std::vector<ClassBand> classes;   ///< by name, from top (left) to bottom (right)
    std::vector<std::size_t> shapes;  ///< the input index of each row, from the top
};

/// Grey value of the lines between classes, all three channels.
inline constexpr std::uint8_t kClassLineGrey = 160;

/// Largest side of a raster, pixels; more than any viewer shows and still below 1 GB.
inline constexpr std::size_t kMaxRasterPixels = 16384;

/// Draws the scores of `labels.size()` shapes against each other. Shapes of a class keep the order of the
/// input. Scores are clamped to [0, 1] for shading: 1 is black, 0 a light tone that still differs from the
/// white of unshaded cells. The diagonal stays white: a query is not a candidate. Ties break by index.
///
/// Errors: those of `checkScoreMatrix`; kInvalidArgument when an option is out of range or the picture would
/// be larger than kMaxRasterPixels.
[[nodiscard]] Result<SimilarityRaster> drawSimilarityMatrix(const ScoreMatrix& scores,
                                                            const std::vector<std::string>& labels,
                                                            const SimilarityMatrixOptions& options = {});

}  // namespace shapedb
