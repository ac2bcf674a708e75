// SPDX-License-Identifier: GPL-3.0-or-later
// Global descriptors and registration of the Point Cloud Library. Built only with SHAPEDB_BENCH_PCL.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/method.h"
#include "core/geometry/motion.h"

namespace shapedb::bench {

/// Their names, even when not built in.
[[nodiscard]] inline std::vector<std::string> peerNames() { return {"esf", "vfh", "gasd"}; }

/// Empty when PCL was not built in.
[[nodiscard]] std::vector<Method> peerMethods();

/// A way to lay one scan on another, both in one unit.
struct PeerAligner {
    std::string name;  ///< for people
    /// The motion that takes `other` to `query`. May draw random numbers from the C library. Errors:
    /// kOutOfMemory, kInternal.
    std::function<Result<Motion>(const PointCloud& query, const PointCloud& other)> align;
};

/// Empty when PCL was not built in.
[[nodiscard]] std::vector<PeerAligner> peerAligners();

/// e.g. "PCL 1.13.0"; empty when it was not built in.
[[nodiscard]] std::string peerLibrary();

}  // namespace shapedb::bench
