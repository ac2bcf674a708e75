// SPDX-License-Identifier: Apache-2.0
// Which name was meant by a mistyped one.
#pragma once

#include <string>
#include <vector>

namespace shapedb {

/// The name that was probably meant by `typed`; empty if none is near.
[[nodiscard]] std::string nearestName(const std::string& typed, const std::vector<std::string>& names);

/// ": did you mean 'NAME'?"; empty for an empty name.
[[nodiscard]] std::string didYouMean(const std::string& name);

}  // namespace shapedb
