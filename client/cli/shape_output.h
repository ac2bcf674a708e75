// How signatures, shapes and alignments are told, as text and as JSON, by every command alike.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/api/types.h"
#include "core/matching/explanation.h"
#include "core/segmentation/segmentation.h"
#include "core/signature/signature.h"

namespace shapedb::cli {

/// An interior of less quality is a guess; the user should know before trusting what follows.
constexpr double kQualityWorthWarning = 0.5;

/// What was computed here, in the form the server answers in. `encoded` is set as well.
[[nodiscard]] client::Signature toClient(const Signature& signature);
[[nodiscard]] client::Explanation toClient(const Explanation& explanation);
[[nodiscard]] client::SegmentationReport reportOf(const Segmentation& segmentation);

/// List of {position, weight, volume_share, peak_radius, extents} by falling weight.
[[nodiscard]] nlohmann::json pointsJson(const client::Signature& signature);
/// {name: shares of the bins, ...}; empty without attributes.
[[nodiscard]] nlohmann::json statisticsJson(const client::Signature& signature);
/// {points: ..., scale, volume}, with attributes also quality.
[[nodiscard]] nlohmann::json toJson(const client::Signature& signature);
/// points, tetrahedra, segments, volume, delaunay_seconds, total_seconds, stages, ...
[[nodiscard]] nlohmann::json toJson(const client::SegmentationReport& report);
[[nodiscard]] nlohmann::json toJson(const client::Explanation& explanation);
[[nodiscard]] nlohmann::json toJson(const client::Shape& shape);

/// How many points were used and where the others went, a line; empty when all were.
[[nodiscard]] std::string preparationText(const client::SegmentationReport& report);
/// How the interior was found, how well and in what noise, a line or two.
[[nodiscard]] std::string interiorText(const client::SegmentationReport& report);
/// How well the interior was told from the outside, a line; says what to do when it is low.
[[nodiscard]] std::string qualityText(double quality);

/// Lower-case hexadecimal digits of binary data (a checksum).
[[nodiscard]] std::string hexText(const std::string& bytes);

/// One line a segment.
[[nodiscard]] std::string signatureTable(const client::Signature& signature);

/// One line a statistic, its bins as small bars; empty without attributes.
[[nodiscard]] std::string statisticsTable(const client::Signature& signature);

/// Why the two match, in a few plain sentences. `queryName` and `hitName` are put in as they are.
[[nodiscard]] std::string explanationText(const client::Explanation& explanation,
                                          const client::Signature& query, const std::string& queryName,
                                          const std::string& hitName);

/// Angle of the rotation in a motion, degrees, [0, 180]. A reflected one is a mirroring in some
/// plane and a turn about that plane's normal: the angle of the turn.
[[nodiscard]] double rotationDegrees(const Motion& motion);

}  // namespace shapedb::cli
