// SPDX-License-Identifier: Apache-2.0
// How to get a file that we do not read into a format that we do. Private to client/io.
#pragma once

#include <string>
#include <string_view>

namespace shapedb::io {

/// For an ending in lower case with its dot: what its format is and which program converts it; empty for an
/// ending that says nothing.
std::string conversionAdvice(std::string_view ending);

}  // namespace shapedb::io
