// Global descriptors of the Point Cloud Library. Built only with SHAPEDB_BENCH_PCL.
#pragma once

#include <string>
#include <vector>

#include "bench/method.h"

namespace shapedb::bench {

/// Their names, even when not built in.
[[nodiscard]] inline std::vector<std::string> peerNames() { return {"esf", "vfh", "gasd"}; }

/// Empty when PCL was not built in.
[[nodiscard]] std::vector<Method> peerMethods();

/// e.g. "PCL 1.13.0"; empty when it was not built in.
[[nodiscard]] std::string peerLibrary();

}  // namespace shapedb::bench
