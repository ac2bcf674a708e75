// SPDX-License-Identifier: GPL-3.0-or-later
// A labelled collection of shapes: families of parametric solids with limbs, and scans of them.
// docs/synthetic.md lists what each family varies.
//
// All functions are pure and thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/synthetic/solid.h"

namespace shapedb {

struct FamilyInfo {
    std::string name;         ///< lower case, suitable for folders and labels, e.g. "animal"
    std::string description;  ///< one line, for people
};

/// All families, sorted by name. Families are only ever added, but their members may change between
/// releases.
[[nodiscard]] std::vector<FamilyInfo> listFamilies();

/// Member `index` of a family; proportions and pose differ clearly between members. One to a few units in
/// size, near the origin, z up, nowhere thinner than 3 % of the diagonal of the bounding box. Same family,
/// index and seed: same solid. Any index is valid.
///
/// Errors: kInvalidArgument when there is no such family (the message lists the existing ones).
[[nodiscard]] Result<Solid> makeMember(const std::string& family, std::size_t index, std::uint64_t seed);

struct ScanOptions {
    std::size_t count = 20000;  ///< points, at least 1
    double noise = 0.0;         ///< sigma over the bounding-box diagonal in the solid's own pose, >= 0
    std::uint64_t seed = 1;     ///< of points, noise and pose; the pose depends on nothing else
    /// Rotates the scan (uniformly), scales it (by 0.1 to 10, log-uniformly) and moves it (by up to ten
    /// diagonals along each axis). Never reflects.
    bool randomPose = true;
};

/// A noisy scan of the whole boundary. Noise is added before the pose, so the same seed gives the same scan
/// with and without a random pose, up to the motion.
///
/// Errors: those of `sampleBoundary` and `addGaussianNoise`.
[[nodiscard]] Result<PointCloud> scanOf(const Solid& solid, const ScanOptions& options);

}  // namespace shapedb
