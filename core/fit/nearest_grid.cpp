// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/nearest_grid.h"

#include <algorithm>
#include <cmath>

namespace shapedb {

namespace {

// Shares of the diagonal.
constexpr float kCell = 1.0f / 40.0f;
constexpr float kMargin = 0.06f;
constexpr float kClosenessWidth = 0.05f;

constexpr std::uint16_t kNone = 0xffffu;

}  // namespace

void SurfaceColumns::add(const Point3& p, const Point3& normal) {
    x.push_back(static_cast<float>(p.x));
    y.push_back(static_cast<float>(p.y));
    z.push_back(static_cast<float>(p.z));
    nx.push_back(static_cast<float>(normal.x));
    ny.push_back(static_cast<float>(normal.y));
    nz.push_back(static_cast<float>(normal.z));
}

void NearestGrid::build(const SurfaceColumns& points, std::size_t count, const Point3& half) {
    scale_ = 1.0f / kCell;
    const std::array<double, 3> reach = {half.x, half.y, half.z};
    Point3 low;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double side = 2.0 * (reach[axis] + static_cast<double>(kMargin));
        cells_[axis] = static_cast<std::int32_t>(std::ceil(side / static_cast<double>(kCell)));
        offset_[axis] = 0.5f * static_cast<float>(cells_[axis]);
    }
    low = {-0.5 * cells_[0], -0.5 * cells_[1], -0.5 * cells_[2]};
    entries_.clear();
    // In units of a cell here, so that the distances below need no scaling.
    for (std::size_t i = 0; i < count; ++i) {
        entries_.push_back(
            {points.x[i], points.y[i], points.z[i], 0.0f, points.nx[i], points.ny[i], points.nz[i], 0.0f});
    }
    fillNearest(low);
    fillCloseness(low);
}

// Each cell takes over the nearest point of a neighbour where that is nearer to its middle than its own:
// along each axis, forwards and backwards (a vector distance transform after Danielsson 1980).
void NearestGrid::fillNearest(const Point3& low) {
    const std::array<std::int32_t, 3> n = cells_;
    const std::size_t total =
        static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
    nearest_.assign(total, kNone);
    std::vector<float> best(total, INFINITY);
    const auto lowX = static_cast<float>(low.x) + 0.5f;
    const auto lowY = static_cast<float>(low.y) + 0.5f;
    const auto lowZ = static_cast<float>(low.z) + 0.5f;
    const auto at = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
        const std::int32_t cell = (z * n[1] + y) * n[0] + x;
        return static_cast<std::size_t>(cell);
    };
    const auto offer = [&](std::int32_t x, std::int32_t y, std::int32_t z, std::uint16_t point) {
        const std::size_t cell = at(x, y, z);
        if (point == kNone || point == nearest_[cell]) return;
        const Entry& e = entries_[point];
        const float dx = scale_ * e.x - (lowX + static_cast<float>(x));
        const float dy = scale_ * e.y - (lowY + static_cast<float>(y));
        const float dz = scale_ * e.z - (lowZ + static_cast<float>(z));
        const float d = dx * dx + dy * dy + dz * dz;
        if (d < best[cell]) {
            best[cell] = d;
            nearest_[cell] = point;
        }
    };
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        const Entry& e = entries_[i];
        const auto cell = [&](float v, std::size_t axis) {
            return std::clamp(static_cast<std::int32_t>(scale_ * v + offset_[axis]), 0, n[axis] - 1);
        };
        offer(cell(e.x, 0), cell(e.y, 1), cell(e.z, 2), static_cast<std::uint16_t>(i));
    }
    const auto sweepRow = [&](std::int32_t y, std::int32_t z) {
        for (std::int32_t x = 1; x < n[0]; ++x) offer(x, y, z, nearest_[at(x - 1, y, z)]);
        for (std::int32_t x = n[0] - 2; x >= 0; --x) offer(x, y, z, nearest_[at(x + 1, y, z)]);
    };
    // A row from that beside it, in its plane or in the next.
    const auto takeRow = [&](std::int32_t y, std::int32_t z, std::int32_t fromY, std::int32_t fromZ) {
        if (fromY < 0 || fromY >= n[1] || fromZ < 0 || fromZ >= n[2]) return;
        for (std::int32_t x = 0; x < n[0]; ++x) offer(x, y, z, nearest_[at(x, fromY, fromZ)]);
    };
    for (const std::int32_t back : {-1, 1}) {
        for (std::int32_t k = 0; k < n[2]; ++k) {
            const std::int32_t z = back < 0 ? k : n[2] - 1 - k;
            for (std::int32_t y = 0; y < n[1]; ++y) {
                takeRow(y, z, y, z + back);
                takeRow(y, z, y - 1, z);
                sweepRow(y, z);
            }
            for (std::int32_t y = n[1] - 2; y >= 0; --y) takeRow(y, z, y + 1, z);
        }
    }
}

void NearestGrid::fillCloseness(const Point3& low) {
    closeness_.resize(nearest_.size());
    const float width = scale_ * kClosenessWidth;
    std::size_t at = 0;
    for (int z = 0; z < cells_[2]; ++z) {
        for (int y = 0; y < cells_[1]; ++y) {
            for (int x = 0; x < cells_[0]; ++x, ++at) {
                const Entry& e = entries_[nearest_[at]];
                const float dx = scale_ * e.x - (static_cast<float>(low.x) + 0.5f + static_cast<float>(x));
                const float dy = scale_ * e.y - (static_cast<float>(low.y) + 0.5f + static_cast<float>(y));
                const float dz = scale_ * e.z - (static_cast<float>(low.z) + 0.5f + static_cast<float>(z));
                const float q = 1.0f + (dx * dx + dy * dy + dz * dz) / (width * width);
                closeness_[at] = static_cast<std::uint8_t>(255.0f / (q * q));
            }
        }
    }
}

}  // namespace shapedb
