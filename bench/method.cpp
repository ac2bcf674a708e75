// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/method.h"

#include <algorithm>
#include <utility>

#include "bench/histogram.h"
#include "bench/peers.h"
#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/pipeline.h"

namespace shapedb::bench {

namespace {

/// As `shapedb evaluate --profile NAME` does.
Method profileMethod(Profile profile) {
    Method method;
    method.name = profileName(profile);
    method.title = "ShapeDB " + method.name;
    method.comparison = "score";
    const ShapeParameters parameters = parametersOf(profile);
    method.describe = [parameters](const PointCloud& points, std::uint64_t,
                                   const RunContext& context) -> Result<Features> {
        auto description = describe(points, parameters, context);
        RETURN_IF_ERROR(description);
        return Features(std::move(description->signature));
    };
    method.score = [](const Features& a, const Features& b) {
        return score(std::get<Signature>(a), std::get<Signature>(b), ScoreOptions{});
    };
    return method;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

Method histogramMethod(std::string name, std::string title, std::string comparison,
                       double (*distance)(const Histogram&, const Histogram&),
                       std::function<Result<Histogram>(const PointCloud&, std::uint64_t)> describe) {
    Method method;
    method.name = std::move(name);
    method.title = std::move(title);
    method.comparison = std::move(comparison);
    method.describe = [describe = std::move(describe)](const PointCloud& points, std::uint64_t seed,
                                                       const RunContext&) -> Result<Features> {
        auto histogram = describe(points, seed);
        RETURN_IF_ERROR(histogram);
        return Features(std::move(*histogram));
    };
    method.score = [distance](const Features& a, const Features& b) {
        return -distance(std::get<Histogram>(a), std::get<Histogram>(b));
    };
    return method;
}

std::vector<Method> allMethods() {
    std::vector<Method> methods = {profileMethod(Profile::kDefault), profileMethod(Profile::kPaper)};
    for (Method& peer : peerMethods()) methods.push_back(std::move(peer));
    methods.push_back(histogramMethod(
        "d2", "D2", "L1", l1Distance,
        [](const PointCloud& points, std::uint64_t seed) { return d2Histogram(points, seed); }));
    return methods;
}

Result<std::vector<Method>> methodsNamed(const std::vector<std::string>& names) {
    std::vector<Method> methods = allMethods();
    if (names.empty()) return methods;
    std::string known;
    std::vector<std::string> built;
    for (const Method& method : methods) {
        built.push_back(method.name);
        known += (known.empty() ? "" : ", ") + method.name;
    }
    for (const std::string& name : names) {
        if (contains(built, name)) continue;
        if (contains(peerNames(), name)) {
            return fail(ErrorCode::kInvalidArgument,
                        "'" + name +
                            "' needs the Point Cloud Library, which this program was built without; "
                            "configure with -DSHAPEDB_BENCH_PCL=ON (scripts/install-deps.sh --bench)");
        }
        return fail(ErrorCode::kInvalidArgument,
                    "there is no method '" + name + "'; the methods are " + known);
    }
    methods.erase(std::remove_if(methods.begin(), methods.end(),
                                 [&](const Method& method) { return !contains(names, method.name); }),
                  methods.end());
    return methods;
}

}  // namespace shapedb::bench
