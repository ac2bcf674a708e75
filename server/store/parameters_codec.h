// SPDX-License-Identifier: GPL-3.0-or-later
// The stored form of a collection's parameters: JSON with every field.
//
// The names are persisted: never rename one. Text of an older server lacks later fields; these are
// off, as in the profile "paper", since that is how the older server worked.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/pipeline.h"

namespace shapedb::store {

/// One line with fields in a fixed order and numbers that read back bit for bit: equal parameters give
/// equal text.
[[nodiscard]] std::string encodeParameters(const ShapeParameters& parameters);

/// The inverse. Errors: kDataLoss, since the text comes from our own database: not JSON, unknown or
/// repeated key, wrong type, value out of range (names the field).
[[nodiscard]] Result<ShapeParameters> decodeParameters(const std::string& text);

/// Whether signatures made with one can be searched among those made with the other: the same text, or the
/// same profile and kind of signature.
[[nodiscard]] bool sameProfile(const std::string& a, const std::string& b);

}  // namespace shapedb::store
