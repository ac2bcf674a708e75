// SPDX-License-Identifier: GPL-3.0-or-later
// Methods to describe shapes and compare the descriptions: ours and the alternatives.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "bench/histogram.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/signature/signature.h"

namespace shapedb::bench {

/// What a method keeps of a shape. All features of one method have the same type (and size).
using Features = std::variant<Histogram, Signature>;

struct Method {
    std::string name;        ///< as --methods takes it, lower case
    std::string title;       ///< for people
    std::string comparison;  ///< how two features are compared, e.g. "L1"
    /// Deterministic in points and seed unless its documentation says otherwise. Runs on the calling thread
    /// alone; may be called from several at once. Errors: the shape cannot be described; kCancelled.
    std::function<Result<Features>(const PointCloud& points, std::uint64_t seed, const RunContext& context)>
        describe;
    /// Higher is more alike; finite; symmetric. Distances are negated.
    std::function<double(const Features& a, const Features& b)> score;
};

/// The profiles of ShapeDB, D2, and the descriptors of the Point Cloud Library if built in.
[[nodiscard]] std::vector<Method> allMethods();

/// Those named, in the order of `allMethods`; all when `names` is empty.
/// Errors: kInvalidArgument for a name that is unknown, or known but not built in.
[[nodiscard]] Result<std::vector<Method>> methodsNamed(const std::vector<std::string>& names);

/// A method that compares histograms by a distance.
[[nodiscard]] Method histogramMethod(
    std::string name, std::string title, std::string comparison,
    double (*distance)(const Histogram&, const Histogram&),
    std::function<Result<Histogram>(const PointCloud& points, std::uint64_t seed)> describe);

}  // namespace shapedb::bench
