// SPDX-License-Identifier: Apache-2.0
#include "client/io/ply_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <string_view>

#include "client/io/output_file.h"
#include "core/base/return_if_error.h"
#include "core/geometry/box.h"
#include "core/geometry/main_part.h"
#include "core/geometry/resolution.h"

namespace shapedb {

namespace {

constexpr Rgb kUnlabelled = {150, 150, 150};

// Red, green, yellow, blue, orange, purple, cyan, magenta, lime, pink, teal, lavender, brown,
// beige, maroon, mint, olive, navy.
constexpr std::array<Rgb, 18> kPicked = {{{230, 25, 75},
                                          {60, 180, 75},
                                          {255, 225, 25},
                                          {67, 99, 216},
                                          {245, 130, 49},
                                          {145, 30, 180},
                                          {66, 212, 244},
                                          {240, 50, 230},
                                          {191, 239, 69},
                                          {250, 190, 212},
                                          {70, 153, 144},
                                          {220, 190, 255},
                                          {154, 99, 36},
                                          {255, 250, 200},
                                          {128, 0, 0},
                                          {170, 255, 195},
                                          {128, 128, 0},
                                          {0, 0, 117}}};

// Hue in turns, saturation and value in 0..1.
Rgb fromHsv(double hue, double saturation, double value) {
    const auto part = [&](double shift) {
        const double k = std::fmod(shift + 6.0 * hue, 6.0);
        const double level = value * (1.0 - saturation * std::max(0.0, std::min({k, 4.0 - k, 1.0})));
        return static_cast<std::uint8_t>(std::lround(255.0 * level));
    };
    return {part(5.0), part(3.0), part(1.0)};
}

// Appends the low byte first, whatever this machine does.
template <typename Unsigned>
void append(std::string& bytes, Unsigned value) {
    for (std::size_t i = 0; i < sizeof value; ++i) bytes += static_cast<char>((value >> (8 * i)) & 0xff);
}

template <typename Bits, typename Number>
void appendNumber(std::string& bytes, Number value) {
    static_assert(sizeof(Bits) == sizeof(Number));
    Bits bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    append(bytes, bits);
}

Result<void> appendPoint(std::string& bytes, const PointCloud& points, std::size_t index,
                         PlyPrecision precision) {
    for (const double coordinate : {points[index].x, points[index].y, points[index].z}) {
        const auto name = [&] { return "point " + std::to_string(index) + " has a coordinate that is "; };
        if (!std::isfinite(coordinate)) {
            return fail(ErrorCode::kNonFiniteCoordinate, name() + "NaN or infinite");
        }
        if (precision == PlyPrecision::kDouble) {
            appendNumber<std::uint64_t>(bytes, coordinate);
            continue;
        }
        if (std::abs(coordinate) > static_cast<double>(std::numeric_limits<float>::max())) {
            return fail(ErrorCode::kCoordinateOutOfRange,
                        name() + "too large for single precision, in which the file stores it");
        }
        appendNumber<std::uint32_t>(bytes, static_cast<float>(coordinate));
    }
    return {};
}

Result<void> writePly(const std::string& path, const PointCloud& points,
                      const std::vector<std::int32_t>* labels, PlyPrecision precision) {
    auto file = io::OutputFile::create(path);
    RETURN_IF_ERROR(file);
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.size()) + "\n";
    for (const char* axis : {"x", "y", "z"}) {
        bytes += std::string("property ") + (precision == PlyPrecision::kDouble ? "double " : "float ") +
                 axis + "\n";
    }
    if (labels != nullptr) {
        bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int segment\n";
    }
    bytes += "end_header\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (const auto done = appendPoint(bytes, points, i, precision); !done) {
            return fail(done.error().code, path + ": " + done.error().message);
        }
        if (labels != nullptr) {
            const Rgb colour = segmentColour((*labels)[i]);
            for (const std::uint8_t part : {colour.red, colour.green, colour.blue}) append(bytes, part);
            append(bytes, static_cast<std::uint32_t>((*labels)[i]));
        }
        RETURN_IF_ERROR(file->write(bytes));
        bytes.clear();
    }
    RETURN_IF_ERROR(file->write(bytes));
    return file->commit();
}

Result<void> writePlyGuarded(const std::string& path, const PointCloud& points,
                             const std::vector<std::int32_t>* labels, PlyPrecision precision) {
    try {
        return writePly(path, points, labels, precision);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, path + ": not enough memory to write the file");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kFileNotWritable, path + ": cannot be written: " + e.what());
    }
}

}  // namespace

Rgb segmentColour(std::int32_t label) {
    if (label < 0) return kUnlabelled;
    const auto index = static_cast<std::size_t>(label);
    if (index < kPicked.size()) return kPicked[index];
    const std::size_t further = index - kPicked.size();
    constexpr double kGoldenTurn = 0.61803398874989485;
    struct Shade {
        double saturation;
        double value;
    };
    constexpr std::array<Shade, 3> kShades = {{{0.85, 0.9}, {0.45, 1.0}, {0.9, 0.55}}};
    const Shade shade = kShades[further % kShades.size()];
    return fromHsv(std::fmod(static_cast<double>(further) * kGoldenTurn, 1.0), shade.saturation, shade.value);
}

Result<void> writeLabelledPly(const std::string& path, const PointCloud& points,
                              const std::vector<std::int32_t>& labels) {
    if (labels.size() != points.size()) {
        return fail(ErrorCode::kInvalidArgument, path + ": " + std::to_string(labels.size()) +
                                                     " labels for " + std::to_string(points.size()) +
                                                     " points; one each is needed");
    }
    const bool far = !points.empty() && isFarFromOrigin(mainPartOf(points).box);
    return writePlyGuarded(path, points, &labels, far ? PlyPrecision::kDouble : PlyPrecision::kSingle);
}

Result<void> writePointsPly(const std::string& path, const PointCloud& points, PlyPrecision precision) {
    return writePlyGuarded(path, points, nullptr, precision);
}

}  // namespace shapedb
