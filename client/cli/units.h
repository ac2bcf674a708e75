// Lengths of files and of collections.
#pragma once

#include <optional>
#include <string>

#include "client/api/client.h"
#include "core/base/error.h"
#include "core/base/length_unit.h"
#include "core/base/run_context.h"

namespace shapedb::cli {

/// By what coordinates in `unit` are multiplied to be in that of the collection; 1 without `unit`. Errors:
/// kInvalidArgument (the collection has no unit); those of getCollection.
[[nodiscard]] Result<double> factorToCollection(const client::Client& client, const std::string& collection,
                                                std::optional<LengthUnit> unit, const RunContext& context);

/// Multiplies all coordinates.
void scaleBy(double factor, PointCloud& points);

/// Multiplies all lengths of motions, both shapes being in the other unit.
void scaleBy(double factor, client::Fit& fit);

/// Multiplies all lengths of an answer, its motions and the coordinates that they take to each other.
void scaleBy(double factor, client::SearchReply& reply);

}  // namespace shapedb::cli
