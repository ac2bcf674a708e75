// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/evaluation/similarity_matrix.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr std::size_t kLinePixels = 1;
constexpr std::size_t kMaxCellPixels = 64;
// How dark a score of 0 is: it must differ from an unshaded cell.
constexpr double kFaintest = 0.12;

struct Colour {
    std::uint8_t red;
    std::uint8_t green;
    std::uint8_t blue;
};

Colour shade(double score, bool rightClass, bool colourWrongClass) {
    const double clamped = std::min(1.0, std::max(0.0, score));
    const double light = 255.0 * (1.0 - (kFaintest + (1.0 - kFaintest) * clamped));
    const auto level = static_cast<std::uint8_t>(std::lround(light));
    if (rightClass || !colourWrongClass) return {level, level, level};
    // Red keeps half its brightness even at score 1, so that the hue stays visible.
    const auto red = static_cast<std::uint8_t>(std::lround(0.5 * (255.0 + light)));
    return {red, level, level};
}

void fill(SimilarityRaster& raster, std::size_t x, std::size_t y, std::size_t width, std::size_t height,
          Colour colour) {
    for (std::size_t row = y; row < y + height; ++row) {
        std::uint8_t* pixel = raster.rgb.data() + 3 * (row * raster.width + x);
        for (std::size_t i = 0; i < width; ++i, pixel += 3) {
            pixel[0] = colour.red;
            pixel[1] = colour.green;
            pixel[2] = colour.blue;
        }
    }
}

Result<void> checkOptions(const SimilarityMatrixOptions& options) {
    if (options.shadedPerQuery == 0) {
        return fail(ErrorCode::kInvalidArgument, "at least one score per query must be shaded");
    }
    if (options.cellPixels == 0 || options.cellPixels > kMaxCellPixels) {
        return fail(ErrorCode::kInvalidArgument, "the cell size must be 1 to " +
                                                     std::to_string(kMaxCellPixels) + " pixels, not " +
                                                     std::to_string(options.cellPixels));
    }
    return {};
}

// Rows grouped by class name, the classes' bands, and the size of the picture; no pixels yet.
SimilarityRaster layOut(const std::vector<std::string>& labels, std::size_t cellPixels) {
    SimilarityRaster raster;
    raster.shapes.resize(labels.size());
    std::iota(raster.shapes.begin(), raster.shapes.end(), std::size_t{0});
    std::stable_sort(raster.shapes.begin(), raster.shapes.end(),
                     [&](std::size_t a, std::size_t b) { return labels[a] < labels[b]; });
    std::size_t pixel = 0;
    for (const std::size_t shape : raster.shapes) {
        if (raster.classes.empty() || raster.classes.back().name != labels[shape]) {
            pixel += kLinePixels;
            raster.classes.push_back({labels[shape], pixel, 0});
        }
        raster.classes.back().pixels += cellPixels;
        pixel += cellPixels;
    }
    raster.width = raster.height = pixel + kLinePixels;
    return raster;
}

// First pixel of every input shape's row and column.
std::vector<std::size_t> cellStarts(const SimilarityRaster& raster, std::size_t cellPixels) {
    std::vector<std::size_t> starts(raster.shapes.size());
    std::size_t row = 0;
    for (const ClassBand& band : raster.classes) {
        for (std::size_t at = 0; at < band.pixels; at += cellPixels) {
            starts[raster.shapes[row++]] = band.firstPixel + at;
        }
    }
    return starts;
}

}  // namespace

Result<SimilarityRaster> drawSimilarityMatrix(const ScoreMatrix& scores,
                                              const std::vector<std::string>& labels,
                                              const SimilarityMatrixOptions& options) {
    RETURN_IF_ERROR(checkOptions(options));
    const std::size_t count = labels.size();
    RETURN_IF_ERROR(checkScoreMatrix(scores, count));

    SimilarityRaster raster = layOut(labels, options.cellPixels);
    if (raster.width > kMaxRasterPixels) {
        return fail(ErrorCode::kInvalidArgument,
                    "the picture of " + std::to_string(count) + " shapes would be " +
                        std::to_string(raster.width) + " pixels wide, more than " +
                        std::to_string(kMaxRasterPixels) + "; use smaller cells or fewer shapes");
    }
    raster.rgb.assign(3 * raster.width * raster.height, 255);
    const Colour line{kClassLineGrey, kClassLineGrey, kClassLineGrey};
    fill(raster, 0, 0, raster.width, kLinePixels, line);
    fill(raster, 0, 0, kLinePixels, raster.height, line);
    for (const ClassBand& band : raster.classes) {
        fill(raster, 0, band.firstPixel + band.pixels, raster.width, kLinePixels, line);
        fill(raster, band.firstPixel + band.pixels, 0, kLinePixels, raster.height, line);
    }

    const std::vector<std::size_t> start = cellStarts(raster, options.cellPixels);
    for (std::size_t query = 0; query < count; ++query) {
        const std::vector<std::size_t> order = rankOthers(scores, count, query);
        const std::size_t shaded = std::min(options.shadedPerQuery, order.size());
        for (std::size_t rank = 0; rank < shaded; ++rank) {
            const std::size_t hit = order[rank];
            fill(raster, start[hit], start[query], options.cellPixels, options.cellPixels,
                 shade(scores[query * count + hit], labels[hit] == labels[query], options.colourWrongClass));
        }
    }
    return raster;
}

}  // namespace shapedb
