// SPDX-License-Identifier: GPL-3.0-or-later
// Stands in for the libraries that are not wanted: for pcl_methods.cpp and pcl_aligners.cpp, for
// faiss_vector_scan.cpp.
#include "bench/peers.h"

namespace shapedb::bench {

#ifndef SHAPEDB_BENCH_PCL
std::vector<Method> peerMethods() { return {}; }

std::vector<PeerAligner> peerAligners() { return {}; }

std::string peerLibrary() { return {}; }
#endif

#ifndef SHAPEDB_BENCH_FAISS
std::unique_ptr<VectorScan> makeVectorScan(std::size_t) { return nullptr; }

std::string vectorScanName() { return {}; }
#endif

}  // namespace shapedb::bench
