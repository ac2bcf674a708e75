// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/evaluation/similarity_matrix.h"

#include <array>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

using Pixel = std::array<int, 3>;
const Pixel kWhite{255, 255, 255};
const Pixel kLine{kClassLineGrey, kClassLineGrey, kClassLineGrey};

Pixel at(const SimilarityRaster& raster, std::size_t x, std::size_t y) {
    const std::size_t i = 3 * (y * raster.width + x);
    return {raster.rgb[i], raster.rgb[i + 1], raster.rgb[i + 2]};
}

ScoreMatrix randomScores(std::size_t n, std::uint64_t seed) {
    Random random(seed);
    ScoreMatrix scores(n * n);
    for (double& s : scores) s = random.uniform();
    return scores;
}

TEST(SimilarityMatrix, LayoutGroupsByClassName) {
    const std::vector<std::string> labels = {"dog", "cat", "dog", "ant", "cat", "dog"};
    SimilarityMatrixOptions options;
    options.cellPixels = 3;
    const auto raster = drawSimilarityMatrix(randomScores(6, 1), labels, options);
    ASSERT_TRUE(raster);
    EXPECT_EQ(raster->shapes, (std::vector<std::size_t>{3, 1, 4, 0, 2, 5}));
    ASSERT_EQ(raster->classes.size(), 3U);
    // A line, 1 ant, a line, 2 cats, a line, 3 dogs, a line.
    EXPECT_EQ(raster->width, 1U + 3 + 1 + 6 + 1 + 9 + 1);
    EXPECT_EQ(raster->height, raster->width);
    EXPECT_EQ(raster->rgb.size(), 3 * raster->width * raster->height);
    const std::array<std::size_t, 3> first = {1, 5, 12};
    const std::array<std::size_t, 3> pixels = {3, 6, 9};
    const std::array<std::string, 3> names = {"ant", "cat", "dog"};
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(raster->classes[c].name, names[c]);
        EXPECT_EQ(raster->classes[c].firstPixel, first[c]);
        EXPECT_EQ(raster->classes[c].pixels, pixels[c]);
    }
    for (const std::size_t line : {0U, 4U, 11U, 21U}) {
        for (std::size_t i = 0; i < raster->width; ++i) {
            EXPECT_EQ(at(*raster, line, i), kLine);
            EXPECT_EQ(at(*raster, i, line), kLine);
        }
    }
}

// With one-pixel cells: the shaded cells of every row are exactly the k best other candidates.
TEST(SimilarityMatrix, ShadesTheBestOfEveryRow) {
    constexpr std::size_t n = 30;
    std::vector<std::string> labels;
    for (std::size_t i = 0; i < n; ++i) labels.push_back(std::string(1, static_cast<char>('a' + i * 7 % 4)));
    const ScoreMatrix scores = randomScores(n, 2);
    SimilarityMatrixOptions options;
    options.cellPixels = 1;
    const auto raster = drawSimilarityMatrix(scores, labels, options);
    ASSERT_TRUE(raster);
    const auto pixelOf = [&](std::size_t row) {
        std::size_t classesBefore = 0;
        std::set<std::string> seen;
        for (std::size_t r = 0; r <= row; ++r) seen.insert(labels[raster->shapes[r]]);
        classesBefore = seen.size();
        return row + classesBefore;
    };
    for (std::size_t r = 0; r < n; ++r) {
        const std::size_t query = raster->shapes[r];
        for (std::size_t c = 0; c < n; ++c) {
            const std::size_t candidate = raster->shapes[c];
            std::size_t better = 0;
            for (std::size_t i = 0; i < n; ++i) {
                if (i != query && scores[query * n + i] > scores[query * n + candidate]) ++better;
            }
            const bool expected = candidate != query && better < 5;
            const Pixel pixel = at(*raster, pixelOf(c), pixelOf(r));
            EXPECT_EQ(pixel != kWhite, expected) << "row " << r << ", column " << c;
            if (!expected) continue;
            if (labels[query] == labels[candidate]) {
                EXPECT_EQ(pixel[0], pixel[1]);
            } else {
                EXPECT_GT(pixel[0], pixel[1]);
            }
            EXPECT_EQ(pixel[1], pixel[2]);
        }
    }
}

TEST(SimilarityMatrix, HigherScoresAreDarkerAndOneIsBlack) {
    // Query 0 has candidates of rising score; all in one class.
    const std::vector<std::string> labels(6, "a");
    ScoreMatrix scores(36, 0.0);
    const std::array<double, 6> row = {1.0, -3.0, 0.0, 0.5, 0.9, 1.0};
    for (std::size_t i = 0; i < 6; ++i) scores[i] = row[i];
    SimilarityMatrixOptions options;
    options.cellPixels = 2;
    options.colourWrongClass = false;
    const auto raster = drawSimilarityMatrix(scores, labels, options);
    ASSERT_TRUE(raster);
    const auto grey = [&](std::size_t column) { return at(*raster, 1 + 2 * column, 1)[0]; };
    EXPECT_EQ(grey(5), 0);
    EXPECT_LT(grey(5), grey(4));
    EXPECT_LT(grey(4), grey(3));
    EXPECT_LT(grey(3), grey(2));
    EXPECT_EQ(grey(2), grey(1));                        // below 0 is clamped
    EXPECT_LT(grey(1), 255);                            // and still shows
    EXPECT_EQ(grey(0), 255);                            // the query itself
    EXPECT_EQ(at(*raster, 11, 2), at(*raster, 12, 1));  // the whole cell is filled
}

TEST(SimilarityMatrix, GreyOnlyWhenAsked) {
    SimilarityMatrixOptions options;
    options.colourWrongClass = false;
    const auto raster =
        drawSimilarityMatrix(randomScores(8, 3), {"a", "b", "a", "b", "a", "b", "a", "b"}, options);
    ASSERT_TRUE(raster);
    for (std::size_t i = 0; i < raster->rgb.size(); i += 3) {
        EXPECT_EQ(raster->rgb[i], raster->rgb[i + 1]);
        EXPECT_EQ(raster->rgb[i], raster->rgb[i + 2]);
    }
}

TEST(SimilarityMatrix, FewerCandidatesThanShades) {
    const auto raster = drawSimilarityMatrix({1, 0.5, 0.5, 1}, {"a", "b"});
    ASSERT_TRUE(raster);
    EXPECT_NE(at(*raster, 1 + 4 + 1, 1), kWhite);
    EXPECT_EQ(at(*raster, 1, 1), kWhite);
    EXPECT_TRUE(drawSimilarityMatrix({1}, {"alone"}));
}

TEST(SimilarityMatrix, RefusesBadInput) {
    const auto codeOf = [](const auto& result) {
        EXPECT_FALSE(result);
        return result ? ErrorCode::kInternal : result.error().code;
    };
    EXPECT_EQ(codeOf(drawSimilarityMatrix(ScoreMatrix(3, 0.0), {"a", "b"})), ErrorCode::kInvalidArgument);
    EXPECT_EQ(codeOf(drawSimilarityMatrix({}, {})), ErrorCode::kInvalidArgument);
    EXPECT_EQ(codeOf(drawSimilarityMatrix({1, std::numeric_limits<double>::quiet_NaN(), 0, 1}, {"a", "b"})),
              ErrorCode::kInvalidArgument);
    SimilarityMatrixOptions options;
    for (const std::size_t cell : {0U, 65U}) {
        options.cellPixels = cell;
        EXPECT_EQ(codeOf(drawSimilarityMatrix({1, 0, 0, 1}, {"a", "b"}, options)),
                  ErrorCode::kInvalidArgument);
    }
    options = {};
    options.shadedPerQuery = 0;
    EXPECT_EQ(codeOf(drawSimilarityMatrix({1, 0, 0, 1}, {"a", "b"}, options)), ErrorCode::kInvalidArgument);
    options = {};
    options.cellPixels = 64;  // 300 * 64 + 2 > 16384
    EXPECT_EQ(
        codeOf(drawSimilarityMatrix(ScoreMatrix(90000, 0.5), std::vector<std::string>(300, "a"), options)),
        ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace shapedb
