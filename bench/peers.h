// SPDX-License-Identifier: GPL-3.0-or-later
// What other libraries do, measured beside ours: descriptors and registration of the Point Cloud Library
// (built only with SHAPEDB_BENCH_PCL), a flat scan of FAISS (SHAPEDB_BENCH_FAISS).
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
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

// A flat scan of plain feature vectors: the baseline of exact search.

/// All vectors of one length in one array, searched by squared Euclidean distance.
class VectorScan {
  public:
    virtual ~VectorScan() = default;
    virtual void add(const float* vectors, std::size_t count) = 0;
    /// The k nearest of one query; ids in ascending order of distance.
    [[nodiscard]] virtual std::vector<long> nearest(const float* query, std::size_t k) const = 0;
};

/// Null if this build has none.
[[nodiscard]] std::unique_ptr<VectorScan> makeVectorScan(std::size_t dimension);
/// "FAISS 1.7.3 IndexFlatL2"; empty without.
[[nodiscard]] std::string vectorScanName();

}  // namespace shapedb::bench
