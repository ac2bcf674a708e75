// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/figure.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include <png.h>

#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

// A 5x7 pixel font for the labels of a picture; ASCII only.

constexpr std::size_t kGlyphColumns = 5;
constexpr std::size_t kGlyphRows = 8;     ///< seven above the base line, one for descenders
constexpr std::size_t kGlyphAdvance = 6;  ///< pixels from one character to the next

using Glyph = std::array<std::uint8_t, kGlyphColumns>;

constexpr char kFirst = ' ';
constexpr char kLast = '~';

// clang-format off
constexpr std::array<Glyph, kLast - kFirst + 1> kGlyphs = {{
    {0x00, 0x00, 0x00, 0x00, 0x00}, {0x00, 0x00, 0x5f, 0x00, 0x00}, {0x00, 0x07, 0x00, 0x07, 0x00},  //   ! "
    {0x14, 0x7f, 0x14, 0x7f, 0x14}, {0x24, 0x2a, 0x7f, 0x2a, 0x12}, {0x23, 0x13, 0x08, 0x64, 0x62},  // # $ %
    {0x36, 0x49, 0x56, 0x20, 0x50}, {0x00, 0x08, 0x07, 0x03, 0x00}, {0x00, 0x1c, 0x22, 0x41, 0x00},  // & ' (
    {0x00, 0x41, 0x22, 0x1c, 0x00}, {0x2a, 0x1c, 0x7f, 0x1c, 0x2a}, {0x08, 0x08, 0x3e, 0x08, 0x08},  // ) * +
    {0x00, 0x80, 0x70, 0x30, 0x00}, {0x08, 0x08, 0x08, 0x08, 0x08}, {0x00, 0x00, 0x60, 0x60, 0x00},  // , - .
    {0x20, 0x10, 0x08, 0x04, 0x02}, {0x3e, 0x51, 0x49, 0x45, 0x3e}, {0x00, 0x42, 0x7f, 0x40, 0x00},  // / 0 1
    {0x72, 0x49, 0x49, 0x49, 0x46}, {0x21, 0x41, 0x49, 0x4d, 0x33}, {0x18, 0x14, 0x12, 0x7f, 0x10},  // 2 3 4
    {0x27, 0x45, 0x45, 0x45, 0x39}, {0x3c, 0x4a, 0x49, 0x49, 0x31}, {0x41, 0x21, 0x11, 0x09, 0x07},  // 5 6 7
    {0x36, 0x49, 0x49, 0x49, 0x36}, {0x46, 0x49, 0x49, 0x29, 0x1e}, {0x00, 0x00, 0x14, 0x00, 0x00},  // 8 9 :
    {0x00, 0x40, 0x34, 0x00, 0x00}, {0x00, 0x08, 0x14, 0x22, 0x41}, {0x14, 0x14, 0x14, 0x14, 0x14},  // ; < =
    {0x00, 0x41, 0x22, 0x14, 0x08}, {0x02, 0x01, 0x59, 0x09, 0x06}, {0x3e, 0x41, 0x5d, 0x59, 0x4e},  // > ? @
    {0x7c, 0x12, 0x11, 0x12, 0x7c}, {0x7f, 0x49, 0x49, 0x49, 0x36}, {0x3e, 0x41, 0x41, 0x41, 0x22},  // A B C
    {0x7f, 0x41, 0x41, 0x41, 0x3e}, {0x7f, 0x49, 0x49, 0x49, 0x41}, {0x7f, 0x09, 0x09, 0x09, 0x01},  // D E F
    {0x3e, 0x41, 0x41, 0x51, 0x73}, {0x7f, 0x08, 0x08, 0x08, 0x7f}, {0x00, 0x41, 0x7f, 0x41, 0x00},  // G H I
    {0x20, 0x40, 0x41, 0x3f, 0x01}, {0x7f, 0x08, 0x14, 0x22, 0x41}, {0x7f, 0x40, 0x40, 0x40, 0x40},  // J K L
    {0x7f, 0x02, 0x1c, 0x02, 0x7f}, {0x7f, 0x04, 0x08, 0x10, 0x7f}, {0x3e, 0x41, 0x41, 0x41, 0x3e},  // M N O
    {0x7f, 0x09, 0x09, 0x09, 0x06}, {0x3e, 0x41, 0x51, 0x21, 0x5e}, {0x7f, 0x09, 0x19, 0x29, 0x46},  // P Q R
    {0x26, 0x49, 0x49, 0x49, 0x32}, {0x03, 0x01, 0x7f, 0x01, 0x03}, {0x3f, 0x40, 0x40, 0x40, 0x3f},  // S T U
    {0x1f, 0x20, 0x40, 0x20, 0x1f}, {0x3f, 0x40, 0x38, 0x40, 0x3f}, {0x63, 0x14, 0x08, 0x14, 0x63},  // V W X
    {0x03, 0x04, 0x78, 0x04, 0x03}, {0x61, 0x59, 0x49, 0x4d, 0x43}, {0x00, 0x7f, 0x41, 0x41, 0x41},  // Y Z [
    {0x02, 0x04, 0x08, 0x10, 0x20}, {0x00, 0x41, 0x41, 0x41, 0x7f}, {0x04, 0x02, 0x01, 0x02, 0x04},  // \ ] ^
    {0x40, 0x40, 0x40, 0x40, 0x40}, {0x00, 0x03, 0x07, 0x08, 0x00}, {0x20, 0x54, 0x54, 0x78, 0x40},  // _ ` a
    {0x7f, 0x28, 0x44, 0x44, 0x38}, {0x38, 0x44, 0x44, 0x44, 0x28}, {0x38, 0x44, 0x44, 0x28, 0x7f},  // b c d
    {0x38, 0x54, 0x54, 0x54, 0x18}, {0x00, 0x08, 0x7e, 0x09, 0x02}, {0x18, 0xa4, 0xa4, 0x9c, 0x78},  // e f g
    {0x7f, 0x08, 0x04, 0x04, 0x78}, {0x00, 0x44, 0x7d, 0x40, 0x00}, {0x20, 0x40, 0x40, 0x3d, 0x00},  // h i j
    {0x7f, 0x10, 0x28, 0x44, 0x00}, {0x00, 0x41, 0x7f, 0x40, 0x00}, {0x7c, 0x04, 0x78, 0x04, 0x78},  // k l m
    {0x7c, 0x08, 0x04, 0x04, 0x78}, {0x38, 0x44, 0x44, 0x44, 0x38}, {0xfc, 0x18, 0x24, 0x24, 0x18},  // n o p
    {0x18, 0x24, 0x24, 0x18, 0xfc}, {0x7c, 0x08, 0x04, 0x04, 0x08}, {0x48, 0x54, 0x54, 0x54, 0x24},  // q r s
    {0x04, 0x04, 0x3f, 0x44, 0x24}, {0x3c, 0x40, 0x40, 0x20, 0x7c}, {0x1c, 0x20, 0x40, 0x20, 0x1c},  // t u v
    {0x3c, 0x40, 0x30, 0x40, 0x3c}, {0x44, 0x28, 0x10, 0x28, 0x44}, {0x4c, 0x90, 0x90, 0x90, 0x7c},  // w x y
    {0x44, 0x64, 0x54, 0x4c, 0x44}, {0x00, 0x08, 0x36, 0x41, 0x00}, {0x00, 0x00, 0x77, 0x00, 0x00},  // z { |
    {0x00, 0x41, 0x36, 0x08, 0x00}, {0x02, 0x01, 0x02, 0x04, 0x02},                                  // } ~
}};
// clang-format on

const Glyph& glyphOf(char c) noexcept {
    const char shown = c >= kFirst && c <= kLast ? c : '?';
    return kGlyphs[static_cast<std::size_t>(shown - kFirst)];
}

constexpr std::size_t kMaxNameCharacters = 24;
constexpr std::size_t kMargin = 6;              // pixels around everything
constexpr std::size_t kSvgFontPixels = 12;      // and, roughly, the height of a line
constexpr std::size_t kSvgCharacterPixels = 8;  // generous width of a character at that size

std::string lowerCaseEnding(const std::string& path) {
    const std::size_t dot = path.find_last_of('.');
    if (dot == std::string::npos || path.find('/', dot) != std::string::npos) return {};
    std::string ending = path.substr(dot);
    for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return ending;
}

// The bands whose names do not overlap at this line height.
std::vector<const ClassBand*> namedBands(const SimilarityRaster& raster, std::size_t lineHeight) {
    std::vector<const ClassBand*> named;
    std::size_t free = 0;  // twice the first free pixel; names are centred on their bands
    for (const ClassBand& band : raster.classes) {
        const std::size_t middle = 2 * band.firstPixel + band.pixels;
        if (!named.empty() && middle < free + lineHeight) continue;
        named.push_back(&band);
        free = middle + lineHeight;
    }
    return named;
}

std::size_t longestName(const SimilarityRaster& raster) {
    std::size_t longest = 0;
    for (const ClassBand& band : raster.classes) longest = std::max(longest, band.name.size());
    return longest;
}

Result<void> notWritable(const std::string& path, const std::string& why) {
    return fail(ErrorCode::kFileNotWritable, "cannot write " + path + ": " + why);
}

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

// `write` fills the file and returns what went wrong, or an empty string. The file is removed if anything
// failed, the last flush included.
template <typename Write>
Result<void> writeFile(const std::string& path, Write write) {
    std::unique_ptr<std::FILE, FileCloser> file(std::fopen(path.c_str(), "wb"));
    if (!file) return notWritable(path, std::strerror(errno));
    std::string problem = write(file.get());
    errno = 0;
    if (std::fclose(file.release()) != 0 && problem.empty()) problem = std::strerror(errno);
    if (problem.empty()) return {};
    std::remove(path.c_str());
    return notWritable(path, problem);
}

struct Canvas {
    std::size_t width = 0;
    std::size_t height = 0;
    std::vector<std::uint8_t> rgb;

    void blacken(std::size_t x, std::size_t y) {
        if (x < width && y < height)
            std::fill_n(rgb.begin() + static_cast<std::ptrdiff_t>(3 * (y * width + x)), 3, std::uint8_t{0});
    }
};

// Calls draw(along, across) for each pixel of the text, counted from its upper left corner.
template <typename Draw>
void forEachTextPixel(const std::string& text, Draw draw) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto& glyph = glyphOf(text[i]);
        for (std::size_t column = 0; column < kGlyphColumns; ++column) {
            for (std::size_t row = 0; row < kGlyphRows; ++row) {
                if ((glyph[column] >> row) & 1U) draw(i * kGlyphAdvance + column, row);
            }
        }
    }
}

Canvas withNames(const SimilarityRaster& raster) {
    const std::size_t strip = std::min(longestName(raster), kMaxNameCharacters) * kGlyphAdvance;
    const std::size_t origin = 2 * kMargin + strip;  // corner of the raster, in both directions
    Canvas canvas;
    canvas.width = origin + raster.width + kMargin;
    canvas.height = origin + raster.height + kMargin;
    canvas.rgb.assign(3 * canvas.width * canvas.height, 255);
    for (std::size_t y = 0; y < raster.height; ++y) {
        std::copy_n(
            raster.rgb.begin() + static_cast<std::ptrdiff_t>(3 * y * raster.width), 3 * raster.width,
            canvas.rgb.begin() + static_cast<std::ptrdiff_t>(3 * ((origin + y) * canvas.width + origin)));
    }
    for (const ClassBand* band : namedBands(raster, kGlyphRows + 1)) {
        const std::string name = band->name.substr(0, kMaxNameCharacters);
        const std::size_t end = origin - kMargin / 2;  // names end at the raster
        const std::size_t start = end - name.size() * kGlyphAdvance;
        const std::size_t middle = origin + band->firstPixel + band->pixels / 2;
        const std::size_t top = middle - kGlyphRows / 2;
        forEachTextPixel(name, [&](std::size_t along, std::size_t across) {
            canvas.blacken(start + along, top + across);    // beside its rows
            canvas.blacken(top + across, end - 1 - along);  // above its columns, read upwards
        });
    }
    return canvas;
}

Result<void> writePng(const SimilarityRaster& raster, const std::string& path) {
    const Canvas canvas = withNames(raster);
    return writeFile(path, [&](std::FILE* file) -> std::string {
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        image.width = static_cast<png_uint_32>(canvas.width);
        image.height = static_cast<png_uint_32>(canvas.height);
        image.format = PNG_FORMAT_RGB;
        const int written = png_image_write_to_stdio(&image, file, 0, canvas.rgb.data(), 0, nullptr);
        const std::string problem = written != 0 ? "" : image.message;
        png_image_free(&image);
        return problem;
    });
}

// The picture as rectangles of one colour, without white: from each uncovered pixel as far right as the
// colour goes, then as far down as the whole run does.
std::string rectangles(const SimilarityRaster& raster) {
    const std::size_t width = raster.width;
    std::vector<bool> covered(width * raster.height, false);
    const auto colourAt = [&](std::size_t i) {
        return (static_cast<std::uint32_t>(raster.rgb[3 * i]) << 16) |
               (static_cast<std::uint32_t>(raster.rgb[3 * i + 1]) << 8) | raster.rgb[3 * i + 2];
    };
    std::string svg;
    for (std::size_t i = 0; i < covered.size(); ++i) {
        const std::uint32_t colour = colourAt(i);
        if (covered[i] || colour == 0xffffffU) continue;
        const auto extends = [&](std::size_t at) { return !covered[at] && colourAt(at) == colour; };
        const std::size_t rowEnd = (i / width + 1) * width;
        std::size_t end = i + 1;
        while (end < rowEnd && extends(end)) ++end;
        const std::size_t run = end - i;
        std::size_t rows = 0;
        bool whole = true;
        while (whole) {
            const std::size_t start = i + rows * width;
            for (std::size_t k = 0; k < run; ++k) covered[start + k] = true;
            ++rows;
            whole = i / width + rows < raster.height;
            for (std::size_t k = 0; whole && k < run; ++k) whole = extends(start + width + k);
        }
        std::array<char, 96> line{};
        std::snprintf(line.data(), line.size(),
                      "<rect x=\"%zu\" y=\"%zu\" width=\"%zu\" height=\"%zu\" fill=\"#%06x\"/>\n", i % width,
                      i / width, run, rows, static_cast<unsigned>(colour));
        svg += line.data();
    }
    return svg;
}

std::string svgOf(const SimilarityRaster& raster) {
    const std::size_t strip = longestName(raster) * kSvgCharacterPixels;
    const std::size_t origin = 2 * kMargin + strip;
    const std::string size = std::to_string(origin + raster.width + kMargin);
    std::string svg =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" +
        size + "\" height=\"" + size + "\" viewBox=\"0 0 " + size + " " + size + "\">\n" +
        "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n<g transform=\"translate(" +
        std::to_string(origin) + " " + std::to_string(origin) + ")\" shape-rendering=\"crispEdges\">\n" +
        rectangles(raster) + "</g>\n<g font-family=\"sans-serif\" font-size=\"" +
        std::to_string(kSvgFontPixels) + "\">\n";
    for (const ClassBand* band : namedBands(raster, kSvgFontPixels)) {
        const std::string middle =
            std::to_string(origin + band->firstPixel + band->pixels / 2 + kSvgFontPixels / 3);
        const std::string edge = std::to_string(origin - kMargin);
        const std::string name = escapeXml(band->name) + "</text>\n";
        svg += "<text text-anchor=\"end\" x=\"" + edge + "\" y=\"" + middle + "\">" + name;
        svg += "<text transform=\"translate(" + middle + " " + edge + ") rotate(-90)\">" + name;
    }
    return svg + "</g>\n</svg>\n";
}

Result<void> writeSvg(const SimilarityRaster& raster, const std::string& path) {
    const std::string svg = svgOf(raster);
    return writeFile(path, [&](std::FILE* file) -> std::string {
        errno = 0;
        return std::fwrite(svg.data(), 1, svg.size(), file) == svg.size() ? "" : std::strerror(errno);
    });
}

}  // namespace

Result<void> checkFigurePath(const std::string& path) {
    const std::string ending = lowerCaseEnding(path);
    if (ending == ".png" || ending == ".svg") return {};
    return fail(ErrorCode::kUnknownFileFormat,
                "unknown picture format: " + path + " must end in .png or .svg");
}

Result<void> writeSimilarityFigure(const SimilarityRaster& raster, const std::string& path) try {
    RETURN_IF_ERROR(checkFigurePath(path));
    if (raster.width == 0 || raster.height == 0 || raster.rgb.size() != 3 * raster.width * raster.height) {
        return fail(ErrorCode::kInvalidArgument,
                    "the number of bytes does not match the size of the picture");
    }
    return lowerCaseEnding(path) == ".png" ? writePng(raster, path) : writeSvg(raster, path);
} catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "not enough memory to write the picture " + path);
}

}  // namespace shapedb::cli
