// SPDX-License-Identifier: GPL-3.0-or-later
// Signatures, shapes and alignments as text and as JSON, the same in every command.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/api/types.h"

namespace shapedb::cli {

/// Below this quality an interior is a guess, and the output says so.
constexpr double kQualityWorthWarning = 0.5;

/// List of {position, weight, volume_share, peak_radius, extents}, heaviest first.
[[nodiscard]] nlohmann::json pointsJson(const client::Signature& signature);
/// {name: shares of the bins, ...}; empty without attributes.
[[nodiscard]] nlohmann::json statisticsJson(const client::Signature& signature);
/// {points, scale, volume}, with attributes also quality.
[[nodiscard]] nlohmann::json toJson(const client::Signature& signature);
[[nodiscard]] nlohmann::json toJson(const client::SegmentationReport& report);
[[nodiscard]] nlohmann::json toJson(const client::Explanation& explanation);
[[nodiscard]] nlohmann::json toJson(const client::Shape& shape);

/// How many points were used and what became of the others, one line; empty if all were used.
[[nodiscard]] std::string preparationText(const client::SegmentationReport& report);
/// How the interior was found, the noise as a share of `scale` (the diagonal), and the quality; two lines.
[[nodiscard]] std::string interiorText(const client::SegmentationReport& report, double scale);
/// How certain the interior is, one line; says what to do if it is not.
[[nodiscard]] std::string qualityText(double quality);

/// One line per part.
[[nodiscard]] std::string signatureTable(const client::Signature& signature);

/// One line per statistic, its bins as small bars; empty without attributes.
[[nodiscard]] std::string statisticsTable(const client::Signature& signature);

/// Why the two match: a first line that can follow "Why X: ", then pairs, motion and differences.
[[nodiscard]] std::string explanationText(const client::Explanation& explanation,
                                          const client::Signature& query, const std::string& queryName,
                                          const std::string& hitName);

/// Angle of the rotation in a motion, degrees, [0, 180]. A reflected one is a mirroring in some plane and a
/// turn about that plane's normal: the angle of the turn.
[[nodiscard]] double rotationDegrees(const Motion& motion);

}  // namespace shapedb::cli
