// SPDX-License-Identifier: GPL-3.0-or-later
// Lengths of files and of collections.
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "client/api/client.h"
#include "client/cli/parameters.h"
#include "core/base/error.h"
#include "core/base/length_unit.h"
#include "core/base/run_context.h"

namespace shapedb::cli {

/// By what coordinates in `unit` are multiplied to be in that of the collection; 1 without `unit`. Errors:
/// kInvalidArgument (the collection has no unit); those of getCollection.
[[nodiscard]] Result<double> factorToCollection(const client::Client& client, const std::string& collection,
                                                std::optional<LengthUnit> unit, const RunContext& context);

/// The unit that an answer speaks in: `asked` (--unit), or else that of the collection.
[[nodiscard]] LengthUnit unitOfAnswer(std::optional<LengthUnit> asked, LengthUnit ofCollection) noexcept;
/// Its name, or null for none.
[[nodiscard]] nlohmann::json unitJson(LengthUnit unit);

/// Whether sizes of files count that have the unit `asked` (--unit). Errors: kInvalidArgument (--free-scale
/// without a unit).
[[nodiscard]] Result<bool> sizesOfFilesCount(std::optional<LengthUnit> asked, const ScoreFlags& score);

/// Multiplies all coordinates.
void scaleBy(double factor, PointCloud& points);

/// Multiplies all lengths of motions, both shapes being in the other unit.
void scaleBy(double factor, client::Fit& fit);

/// Multiplies all lengths of a comparison, both shapes being in the other unit.
void scaleBy(double factor, client::Comparison& comparison);

/// Multiplies all lengths of an answer, its motions and the coordinates that they take to each other.
void scaleBy(double factor, client::SearchReply& reply);

}  // namespace shapedb::cli
