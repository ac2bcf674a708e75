// The labels a client gives to a shape.
#pragma once

#include <map>
#include <string>

namespace shapedb {

/// Unique keys, sorted. Whoever accepts metadata from outside checks its limits.
using Metadata = std::map<std::string, std::string>;

}  // namespace shapedb
