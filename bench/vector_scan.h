// SPDX-License-Identifier: GPL-3.0-or-later
// A flat scan of plain feature vectors: the baseline of exact search.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace shapedb::bench {

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
