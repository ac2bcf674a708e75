// The project's own labelled collection: families of parametric solids with limbs, and scans of
// them. What each family varies is listed in docs/synthetic.md.
//
// All functions are pure and may be called from any number of threads at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/synthetic/solid.h"

namespace shapedb {

struct FamilyInfo {
    std::string name;         ///< lower case, fit for a folder or a label, e.g. "animal"
    std::string description;  ///< one line for a person
};

/// All families, by name. The list only grows; a family's members may change between releases.
[[nodiscard]] std::vector<FamilyInfo> listFamilies();

/// Member `index` of a family: proportions and pose differ clearly between members. One to a few
/// units in size, near the origin, z up, and nothing thinner than 3 % of the diagonal of the
/// bounding box. Same family, index and seed: same solid. Any index is valid.
///
/// Errors: kInvalidArgument when there is no such family (the message lists those there are).
[[nodiscard]] Result<Solid> makeMember(const std::string& family, std::size_t index, std::uint64_t seed);

struct ScanOptions {
    std::size_t count = 20000;  ///< points, at least 1
    double noise = 0.0;      ///< sigma as a share of the bounding-box diagonal in the solid's own pose, >= 0
    std::uint64_t seed = 1;  ///< of points, noise and pose; the pose depends on nothing else
    /// Whether to turn the scan (uniform over all rotations), scale it (0.1 to 10, even in the
    /// logarithm) and move it (up to ten diagonals along each axis). Never reflects.
    bool randomPose = true;
};

/// A noisy scan of the whole boundary. Noise is added before the pose, so that one seed gives the
/// same scan in either pose up to that motion.
///
/// Errors: those of `sampleBoundary` and `addGaussianNoise`.
[[nodiscard]] Result<PointCloud> scanOf(const Solid& solid, const ScanOptions& options);

}  // namespace shapedb
