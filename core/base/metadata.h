// SPDX-License-Identifier: Apache-2.0
// What clients say about a shape: text under unique text keys, such as its label.
#pragma once

#include <map>
#include <string>

namespace shapedb {

/// Sorted by key. The limits (64 entries; keys 1 to 128 bytes of [A-Za-z0-9_.-]; values up to 1,024 bytes of
/// UTF-8) are checked where requests arrive.
using Metadata = std::map<std::string, std::string>;

}  // namespace shapedb
