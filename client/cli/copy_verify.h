// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb admin copy --verify`: whether two servers have the same.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client/cli/copy_difference.h"

namespace shapedb::cli {

/// Differences that are kept; others are counted.
constexpr std::size_t kMostNamed = 1000;

/// How many shapes of a collection either has, and how many of them differ.
struct CollectionComparison {
    std::string name;
    std::uint64_t from = 0;
    std::uint64_t to = 0;
    std::uint64_t different = 0;
};

struct NamedDifference {
    std::string collection;
    ShapePair pair;
};

struct CopyComparison {
    std::vector<CollectionStep> steps;              ///< what differs of collections and aliases
    std::vector<CollectionComparison> collections;  ///< those that both have
    std::vector<NamedDifference> differences;       ///< the first kMostNamed
    std::uint64_t different = 0;                    ///< shapes, all of them

    [[nodiscard]] bool equal() const { return steps.empty() && different == 0; }
};

/// Compares every key: points by SHA-256 and origin, metadata, state. What was being written while it looked
/// is looked at again, unless there are more differences than it names. `progress` as of CopyRun. Errors: of
/// either server.
[[nodiscard]] Result<CopyComparison> compareServers(
    const CopySides& sides,
    const std::function<void(const std::string& what, std::uint64_t done, std::uint64_t total)>& progress,
    const RunContext& context);

}  // namespace shapedb::cli
