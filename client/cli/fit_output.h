// SPDX-License-Identifier: GPL-3.0-or-later
// How one shape lies on another, as text and as JSON, the same in every command.
#pragma once

#include <array>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/api/types.h"

namespace shapedb::cli {

/// Row-major 4 x 4: takes a column (x, y, z, 1) of the shape to the query's coordinates.
[[nodiscard]] std::array<double, 16> matrixOf(const Motion& motion);

/// That matrix with all its digits: four lines of four numbers.
[[nodiscard]] std::string matrixText(const Motion& motion);

/// {matrix, score, residual, explained_query, explained_other, reflected, scale, ...}; with the members of
/// the best pose at the top.
[[nodiscard]] nlohmann::json toJson(const client::Fit& fit);

/// What is done to the shape to lay it on the query, one line.
[[nodiscard]] std::string fitMotionText(const Motion& motion, const std::string& name);

/// verdictName, or null for none.
[[nodiscard]] nlohmann::json verdictJson(Verdict verdict);
/// verdictName, or "" for none: a cell of CSV.
[[nodiscard]] std::string verdictCell(Verdict verdict);

/// Whether the shape lies on the query only as a mirror image. `Fit`: client::Fit, or core's FitResult.
template <typename Fit>
[[nodiscard]] bool fitsMirrored(const Fit& fit) {
    return fit.best.motion.reflected && !fit.handednessOpen;
}
/// The same where the shape may not have been laid on the query.
template <typename Fit>
[[nodiscard]] std::optional<bool> fitsMirrored(const std::optional<Fit>& fit) {
    return fit ? std::optional<bool>(fitsMirrored(*fit)) : std::nullopt;
}
/// True, false, or null if that is not known.
[[nodiscard]] nlohmann::json mirroredJson(std::optional<bool> mirrored);
/// "1", "0", or "" if that is not known: a cell of CSV.
[[nodiscard]] std::string mirroredCell(std::optional<bool> mirrored);

/// What two shapes are to each other, in words: "same object, mirrored", "same object, bent", and so on; ""
/// if that is unknown. `part`: what to say of a query that is a piece of the other.
[[nodiscard]] std::string likenessText(Verdict verdict, std::optional<bool> mirrored,
                                       const std::string& part = "query is part of it");

/// The line for SearchReply::leftRightUntold.
constexpr const char* kLeftRightUntold =
    "mirror images score nearly alike here: only laying shapes on the query (--verify) tells left from "
    "right\n";

/// How well the shape fits and how certain its pose is; a few lines.
[[nodiscard]] std::string fitText(const client::Fit& fit, const std::string& queryName,
                                  const std::string& otherName);

}  // namespace shapedb::cli
