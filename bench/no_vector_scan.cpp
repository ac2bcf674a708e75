// SPDX-License-Identifier: GPL-3.0-or-later
// Stands in for faiss_vector_scan.cpp where FAISS is not wanted.
#include "bench/vector_scan.h"

namespace shapedb::bench {

std::unique_ptr<VectorScan> makeVectorScan(std::size_t) { return nullptr; }

std::string vectorScanName() { return {}; }

}  // namespace shapedb::bench
