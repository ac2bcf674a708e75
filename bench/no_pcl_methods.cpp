// SPDX-License-Identifier: GPL-3.0-or-later
// Stands in for pcl_methods.cpp and pcl_aligners.cpp where the Point Cloud Library is not wanted.
#include "bench/peers.h"

namespace shapedb::bench {

std::vector<Method> peerMethods() { return {}; }

std::vector<PeerAligner> peerAligners() { return {}; }

std::string peerLibrary() { return {}; }

}  // namespace shapedb::bench
