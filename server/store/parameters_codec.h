// The text in which a collection's parameters are stored: JSON with every field.
//
// The names are persisted: never rename one. Text of an older server lacks the fields added since;
// they take the value that it worked with: off, as in the profile "paper", whatever the profile.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/pipeline.h"

namespace shapedb::index {

/// One line, fields in a fixed order, numbers that read back bit for bit: equal parameters
/// give equal text.
[[nodiscard]] std::string encodeParameters(const ShapeParameters& parameters);

/// The inverse. Errors: kDataLoss (not JSON, unknown or doubled key, wrong type, value outside its range:
/// the message names the field): the text came from our own database.
[[nodiscard]] Result<ShapeParameters> decodeParameters(const std::string& text);

}  // namespace shapedb::index
