// SPDX-License-Identifier: GPL-3.0-or-later
// The scale of scores: how a distance between shapes becomes a score in [0, 1].
#pragma once

namespace shapedb {

/// 1 / (1 + (2 D)^2), in (0, 1]: 1 for distance 0, about 0.2 for distance 1, which is typical of unrelated
/// shapes. `distance` is finite, at least 0.
[[nodiscard]] double scoreOfDistance(double distance) noexcept;

/// The inverse, up to rounding; infinite for a score of 0.
[[nodiscard]] double distanceOfScore(double score) noexcept;

}  // namespace shapedb
