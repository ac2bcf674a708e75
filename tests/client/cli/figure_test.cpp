// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/figure.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>

#include "core/base/random.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;

class Figure : public ::testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::path(::testing::TempDir()) /
                  ("figure_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    std::string path(const std::string& name) const { return (folder_ / name).string(); }

    fs::path folder_;
};

SimilarityRaster raster(const std::vector<std::string>& classes, std::size_t members) {
    std::vector<std::string> labels;
    for (const std::string& name : classes) labels.insert(labels.end(), members, name);
    Random random(1);
    ScoreMatrix scores(labels.size() * labels.size());
    for (double& s : scores) s = random.uniform();
    const auto drawn = drawSimilarityMatrix(scores, labels);
    EXPECT_TRUE(drawn);
    return *drawn;
}

struct Picture {
    std::size_t width = 0;
    std::size_t height = 0;
    std::vector<std::uint8_t> rgb;

    std::array<int, 3> at(std::size_t x, std::size_t y) const {
        const std::size_t i = 3 * (y * width + x);
        return {rgb[i], rgb[i + 1], rgb[i + 2]};
    }
};

Picture readPng(const std::string& path) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    EXPECT_NE(png_image_begin_read_from_file(&image, path.c_str()), 0) << image.message;
    image.format = PNG_FORMAT_RGB;
    Picture picture{image.width, image.height, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(image))};
    EXPECT_NE(png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr), 0) << image.message;
    return picture;
}

std::string readText(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

// The lower right of the picture is the raster, pixel by pixel; every class has black ink left of it and
// above.
TEST_F(Figure, PngHasTheRasterAndItsLabels) {
    const SimilarityRaster drawn = raster({"ant", "bee", "cat"}, 6);
    ASSERT_TRUE(writeSimilarityFigure(drawn, path("a.png")));
    const Picture picture = readPng(path("a.png"));
    const std::size_t margin = 6;
    ASSERT_GT(picture.width, drawn.width + margin);
    ASSERT_EQ(picture.width, picture.height);
    const std::size_t origin = picture.width - margin - drawn.width;
    for (std::size_t y = 0; y < drawn.height; ++y) {
        for (std::size_t x = 0; x < drawn.width; ++x) {
            const std::size_t i = 3 * (y * drawn.width + x);
            const std::array<int, 3> expected = {drawn.rgb[i], drawn.rgb[i + 1], drawn.rgb[i + 2]};
            ASSERT_EQ(picture.at(origin + x, origin + y), expected) << x << ", " << y;
        }
    }
    for (const ClassBand& band : drawn.classes) {
        int left = 0;
        int above = 0;
        for (std::size_t i = 0; i < origin; ++i) {
            for (std::size_t k = 0; k < band.pixels; ++k) {
                left += picture.at(i, origin + band.firstPixel + k)[0] == 0 ? 1 : 0;
                above += picture.at(origin + band.firstPixel + k, i)[0] == 0 ? 1 : 0;
            }
        }
        EXPECT_GT(left, 15) << band.name;
        EXPECT_EQ(left, above) << band.name;
    }
}

// Painting the rectangles of the SVG must give the raster.
TEST_F(Figure, SvgHasTheSamePixels) {
    const SimilarityRaster drawn = raster({"ant", "bee", "cat"}, 7);
    ASSERT_TRUE(writeSimilarityFigure(drawn, path("a.SVG")));
    const std::string svg = readText(path("a.SVG"));
    std::vector<std::uint8_t> painted(drawn.rgb.size(), 255);
    const std::regex rect(
        "<rect x=\"(\\d+)\" y=\"(\\d+)\" width=\"(\\d+)\" height=\"(\\d+)\" fill=\"#([0-9a-f]{6})\"/>");
    for (std::sregex_iterator it(svg.begin(), svg.end(), rect), end; it != end; ++it) {
        const std::size_t x = std::stoul((*it)[1]);
        const std::size_t y = std::stoul((*it)[2]);
        const std::size_t right = x + std::stoul((*it)[3]);
        const std::size_t bottom = y + std::stoul((*it)[4]);
        const auto colour = static_cast<std::uint32_t>(std::stoul((*it)[5], nullptr, 16));
        ASSERT_LE(right, drawn.width);
        ASSERT_LE(bottom, drawn.height);
        for (std::size_t row = y; row < bottom; ++row) {
            for (std::size_t column = x; column < right; ++column) {
                std::uint8_t* pixel = &painted[3 * (row * drawn.width + column)];
                EXPECT_EQ(pixel[0] + pixel[1] + pixel[2], 3 * 255) << "painted twice";
                pixel[0] = static_cast<std::uint8_t>(colour >> 16);
                pixel[1] = static_cast<std::uint8_t>(colour >> 8);
                pixel[2] = static_cast<std::uint8_t>(colour);
            }
        }
    }
    EXPECT_EQ(painted, drawn.rgb);
}

TEST_F(Figure, SvgLabelsEveryClassTwiceAndEscapesNames) {
    const SimilarityRaster drawn = raster({"ant & bee", "<cat>", "d\"o\ng"}, 5);
    ASSERT_TRUE(writeSimilarityFigure(drawn, path("a.svg")));
    const std::string svg = readText(path("a.svg"));
    for (const std::string name : {"ant &amp; bee", "&lt;cat&gt;", "d&quot;o?g"}) {
        const std::string element = ">" + name + "</text>";
        const std::size_t first = svg.find(element);
        ASSERT_NE(first, std::string::npos) << name;
        EXPECT_NE(svg.find(element, first + 1), std::string::npos) << name;
    }
    EXPECT_EQ(svg.find("<cat>"), std::string::npos);
}

TEST_F(Figure, LongNamesAndNarrowBandsAreDrawn) {
    const SimilarityRaster drawn = raster({std::string(200, 'x'), "k\xc3\xa4se", "z", "zz"}, 1);
    EXPECT_TRUE(writeSimilarityFigure(drawn, path("a.png")));
    EXPECT_LT(readPng(path("a.png")).width, 300U);
    EXPECT_TRUE(writeSimilarityFigure(drawn, path("a.svg")));
}

TEST_F(Figure, RefusesOtherEndings) {
    const SimilarityRaster drawn = raster({"a", "b"}, 2);
    for (const std::string name : {"a.jpg", "a", "png", "a.png.txt", "a.png/b"}) {
        const auto written = writeSimilarityFigure(drawn, path(name));
        ASSERT_FALSE(written) << name;
        EXPECT_EQ(written.error().code, ErrorCode::kUnknownFileFormat) << name;
        EXPECT_FALSE(fs::exists(path(name)));
        EXPECT_FALSE(checkFigurePath(path(name)));
    }
    EXPECT_TRUE(checkFigurePath("x.PNG"));
}

TEST_F(Figure, ReportsAnUnwritableFile) {
    const SimilarityRaster drawn = raster({"a", "b"}, 2);
    for (const std::string name : {"missing/a.png", "missing/a.svg"}) {
        const auto written = writeSimilarityFigure(drawn, path(name));
        ASSERT_FALSE(written) << name;
        EXPECT_EQ(written.error().code, ErrorCode::kFileNotWritable);
        EXPECT_NE(written.error().message.find(name), std::string::npos);
    }
}

TEST_F(Figure, RefusesARasterOfTheWrongSize) {
    SimilarityRaster drawn = raster({"a", "b"}, 2);
    drawn.rgb.pop_back();
    EXPECT_EQ(writeSimilarityFigure(drawn, path("a.png")).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(writeSimilarityFigure({}, path("a.png")).error().code, ErrorCode::kInvalidArgument);
}

// A full device is reported, whichever call notices it.
TEST_F(Figure, FullDeviceIsAnError) {
    const SimilarityRaster drawn = raster({"a", "b"}, 5);
    for (const std::string name : {"full.png", "full.svg"}) {
        fs::create_symlink("/dev/full", path(name));
        const auto written = writeSimilarityFigure(drawn, path(name));
        ASSERT_FALSE(written) << name;
        EXPECT_EQ(written.error().code, ErrorCode::kFileNotWritable);
        EXPECT_FALSE(fs::exists(fs::symlink_status(path(name)))) << "the remains were not removed";
    }
}

}  // namespace
}  // namespace shapedb::cli
