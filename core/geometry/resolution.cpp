// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/resolution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/base/count_text.h"

namespace shapedb {

namespace {

constexpr double kLargestSingle = std::numeric_limits<float>::max();

/// Share of the size below which a scan is flat along an axis; as sanitise has it.
constexpr double kFlatShare = 1e-6;

/// Of points rounded to multiples of a step half are odd ones; at least this share, however they lie.
constexpr double kLeastOddShare = 0.125;

struct Axis {
    double largest = 0.0;
    double extent = 0.0;
};

std::array<Axis, 3> axesOf(const Box& box) {
    const auto axis = [](double low, double high) {
        return Axis{std::max(std::abs(low), std::abs(high)), high - low};
    };
    return {axis(box.low.x, box.high.x), axis(box.low.y, box.high.y), axis(box.low.z, box.high.z)};
}

double sizeOf(const std::array<Axis, 3>& axes) {
    // The square of a small extent may be zero.
    return std::hypot(axes[0].extent, axes[1].extent, axes[2].extent);
}

template <typename Number>
double stepAt(double magnitude) {
    const auto from = std::min(static_cast<Number>(magnitude),
                               std::nextafter(std::numeric_limits<Number>::max(), Number{0}));
    return static_cast<double>(std::nextafter(from, std::numeric_limits<Number>::infinity())) -
           static_cast<double>(from);
}

template <typename Number>
std::optional<CoarseCoordinates> coarse(const std::array<Axis, 3>& axes, double leastSteps) {
    const double size = sizeOf(axes);
    double largest = 0.0;
    for (const Axis& axis : axes) largest = std::max(largest, axis.largest);
    const double step = stepAt<Number>(largest);
    if (!(size > 0.0) || step * leastSteps <= size) return std::nullopt;
    return CoarseCoordinates{largest, step, size};
}

bool isSingle(double value) { return static_cast<double>(static_cast<float>(value)) == value; }

/// Whether the points use single precision to its last digit where its step is at least `step`: where it is
/// smaller they say nothing.
bool useStep(const PointCloud& points, double step) {
    const auto isOdd = [&](double value) {
        return stepAt<float>(std::abs(value)) >= step && std::fmod(value, 2.0 * step) != 0.0;
    };
    const auto odd = std::count_if(points.begin(), points.end(),
                                   [&](const Point3& p) { return isOdd(p.x) || isOdd(p.y) || isOdd(p.z); });
    return static_cast<double>(odd) >= kLeastOddShare * static_cast<double>(points.size());
}

}  // namespace

std::string CoarseCoordinates::text(const char* precision) const {
    char buffer[200];
    std::snprintf(buffer, sizeof buffer,
                  "coordinates up to %.6g are %.3g apart in %s, but the scan is only %.3g across", largest,
                  step, precision, across);
    if (outliers == 0) return buffer;
    return buffer + std::string(", without ") + countText(outliers, "point") + " far from the others";
}

bool isFarFromOrigin(const Box& box) {
    const auto axes = axesOf(box);
    const double size = sizeOf(axes);
    return size > 0.0 &&
           std::max({axes[0].largest, axes[1].largest, axes[2].largest}) > kFarFromOrigin * size;
}

std::optional<CoarseCoordinates> coarseInSinglePrecision(const Box& box, std::uint64_t points) {
    const auto axes = axesOf(box);
    const double inARow = std::sqrt(static_cast<double>(points));
    if (const auto found = coarse<float>(axes, std::max(kLeastSteps, inARow))) return found;
    const double flat = kFlatShare * sizeOf(axes);
    for (const Axis& axis : axes) {
        const double step = stepAt<float>(axis.largest);
        if (axis.extent > flat && step * kLeastStepsOfAxis > axis.extent) {
            return CoarseCoordinates{axis.largest, step, axis.extent};
        }
    }
    return std::nullopt;
}

std::optional<CoarseCoordinates> coarseInSinglePrecision(const MainPart& part) {
    auto found = coarseInSinglePrecision(part.box, part.points);
    if (found) found->outliers = part.outliers;
    return found;
}

bool maybeFlattened(const MainPart& part) {
    const auto axes = axesOf(part.box);
    const double hidden = kFlatShare * sizeOf(axes);
    return std::any_of(axes.begin(), axes.end(), [&](const Axis& axis) {
        return axis.largest > 0.0 && stepAt<float>(axis.largest) > hidden;
    });
}

std::optional<CoarseCoordinates> coarseInDoublePrecision(const Box& box, const Point3& origin) {
    auto axes = axesOf({box.low + origin, box.high + origin});
    // The sums may all be the same number.
    const auto own = axesOf(box);
    for (std::size_t i = 0; i < axes.size(); ++i) axes[i].extent = own[i].extent;
    return coarse<double>(axes, kLeastDoubleSteps);
}

Result<void> checkNotRounded(const PointCloud& points) {
    if (points.empty()) return {};
    for (const Point3& p : points) {
        if (!isFinite(p) || std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kLargestSingle)
            return {};
    }
    // First, for it is cheap: mostly the first point says that they were not.
    const bool rounded = std::all_of(points.begin(), points.end(), [](const Point3& p) {
        return isSingle(p.x) && isSingle(p.y) && isSingle(p.z);
    });
    if (!rounded) return {};
    const auto found = coarseInSinglePrecision(mainPartOf(points));
    if (!found || !useStep(points, found->step)) return {};
    return fail(ErrorCode::kCoordinateOutOfRange,
                found->text() +
                    ", and all of them are such numbers: the shape was lost when they were written in "
                    "single precision. Write them again in double precision, or relative to a point "
                    "near the scan");
}

}  // namespace shapedb
