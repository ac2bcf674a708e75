// Signatures with attributes: random ones of every awkward kind, and those of scans.
#pragma once

#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/signature/signature.h"

namespace shapedb::testing_support {

/// 1 to `maxPoints` points (placed and weighted as `randomSignature` does), each with a random
/// extent, and random statistics and quality.
Signature randomAttributed(Random& random, std::size_t maxPoints = 10);

/// The same shape, its parts moved and changed a little (by `noise` of the scale, resp. of
/// themselves), its statistics too.
Signature disturbedAttributed(Signature signature, Random& random, double noise);

/// In another pose: every position and every extent through a rotation or reflection. Statistics
/// do not know the pose.
Signature turnedAttributed(Signature signature, const Matrix3& rotation);

/// Anew from the points; after these were changed.
void updateBody(Signature& signature);

struct Scan {
    std::string family;
    std::size_t member = 0;
    Signature signature;
};

/// With the default profile: `members` of each family, `scans` of each member. Made once a process
/// for each pair of arguments.
const std::vector<Scan>& scannedFamilies(std::size_t members, std::size_t scans);

}  // namespace shapedb::testing_support
