// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

// How far off the boundary samples are probed, as a share of the diagonal: far above rounding, far below any
// distance between samples.
constexpr double kProbeShare = 1e-9;
constexpr std::size_t kTrialsPerPoint = 1000;

template <class... Cases>
struct Overloaded : Cases... {
    using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

template <typename... Cases>
auto match(const SolidShape& shape, Cases... cases) {
    return std::visit(Overloaded<Cases...>{cases...}, shape);
}

bool isLength(double x) { return std::isfinite(x) && x > 0.0; }
bool areLengths(const Point3& p) { return isLength(p.x) && isLength(p.y) && isLength(p.z); }
double smallest(const Point3& p) { return std::min({p.x, p.y, p.z}); }

bool hasValidLengths(const SolidShape& shape) {
    return match(
        shape, [](const SolidSphere& s) { return isLength(s.radius); },
        [](const SolidEllipsoid& s) { return areLengths(s.semiAxes); },
        [](const SolidCapsule& s) { return isLength(s.radius) && isLength(s.halfLength); },
        [](const SolidTube& s) {
            return isLength(s.radius) && isLength(s.halfLength) && s.innerRadius >= 0.0 &&
                   s.innerRadius < s.radius;
        },
        [](const SolidBox& s) { return areLengths(s.halfSides); },
        [](const SolidTorus& s) {
            return isLength(s.ringRadius) && isLength(s.tubeRadius) && s.tubeRadius < s.ringRadius;
        });
}

bool isValidPlacement(const Motion& motion) {
    if (!isLength(motion.scale) || !std::isfinite(squaredLength(motion.translation))) return false;
    const auto& r = motion.rotation;
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = a; b < 3; ++b) {
            const double product = r[a][0] * r[b][0] + r[a][1] * r[b][1] + r[a][2] * r[b][2];
            if (!(std::abs(product - (a == b ? 1.0 : 0.0)) < 1e-9)) return false;
        }
    }
    return (determinant(r) < 0.0) == motion.reflected;
}

double localImplicit(const SolidShape& shape, const Point3& p) {
    return match(
        shape, [&](const SolidSphere& s) { return length(p) - s.radius; },
        [&](const SolidEllipsoid& s) {
            return length(Point3{p.x / s.semiAxes.x, p.y / s.semiAxes.y, p.z / s.semiAxes.z}) - 1.0;
        },
        [&](const SolidCapsule& s) {
            const double along = std::min(s.halfLength, std::max(-s.halfLength, p.z));
            return length(Point3{p.x, p.y, p.z - along}) - s.radius;
        },
        [&](const SolidTube& s) {
            const double radial = std::hypot(p.x, p.y);
            const double sides =
                s.innerRadius > 0.0 ? std::max(radial - s.radius, s.innerRadius - radial) : radial - s.radius;
            return std::max(sides, std::abs(p.z) - s.halfLength);
        },
        [&](const SolidBox& s) {
            return std::max({std::abs(p.x) - s.halfSides.x, std::abs(p.y) - s.halfSides.y,
                             std::abs(p.z) - s.halfSides.z});
        },
        [&](const SolidTorus& s) {
            return std::hypot(std::hypot(p.x, p.y) - s.ringRadius, p.z) - s.tubeRadius;
        });
}

// The support function: how far the shape extends from its centre in the unit direction d.
double reach(const SolidShape& shape, const Point3& d) {
    const double across = std::hypot(d.x, d.y);
    return match(
        shape, [&](const SolidSphere& s) { return s.radius; },
        [&](const SolidEllipsoid& s) {
            return length(Point3{s.semiAxes.x * d.x, s.semiAxes.y * d.y, s.semiAxes.z * d.z});
        },
        [&](const SolidCapsule& s) { return s.radius + s.halfLength * std::abs(d.z); },
        [&](const SolidTube& s) { return s.radius * across + s.halfLength * std::abs(d.z); },
        [&](const SolidBox& s) {
            return s.halfSides.x * std::abs(d.x) + s.halfSides.y * std::abs(d.y) +
                   s.halfSides.z * std::abs(d.z);
        },
        [&](const SolidTorus& s) { return s.ringRadius * across + s.tubeRadius; });
}

double thickness(const SolidShape& shape) {
    return match(
        shape, [](const SolidSphere& s) { return 2.0 * s.radius; },
        [](const SolidEllipsoid& s) { return 2.0 * smallest(s.semiAxes); },
        [](const SolidCapsule& s) { return 2.0 * s.radius; },
        [](const SolidTube& s) {
            const double side = s.innerRadius > 0.0 ? s.radius - s.innerRadius : 2.0 * s.radius;
            return std::min(side, 2.0 * s.halfLength);
        },
        [](const SolidBox& s) { return 2.0 * smallest(s.halfSides); },
        [](const SolidTorus& s) { return 2.0 * s.tubeRadius; });
}

// The area; for ellipsoid and torus the larger area that their samplers cover evenly before rejection.
double envelopeArea(const SolidShape& shape) {
    return match(
        shape, [](const SolidSphere& s) { return 4.0 * kPi * s.radius * s.radius; },
        [](const SolidEllipsoid& s) {
            const Point3& a = s.semiAxes;
            return 4.0 * kPi * a.x * a.y * a.z / smallest(a);
        },
        [](const SolidCapsule& s) { return 4.0 * kPi * s.radius * (s.radius + s.halfLength); },
        [](const SolidTube& s) {
            const double sides = 4.0 * kPi * (s.radius + s.innerRadius) * s.halfLength;
            return sides + 2.0 * kPi * (s.radius * s.radius - s.innerRadius * s.innerRadius);
        },
        [](const SolidBox& s) {
            const Point3& h = s.halfSides;
            return 8.0 * (h.x * h.y + h.y * h.z + h.z * h.x);
        },
        [](const SolidTorus& s) { return 4.0 * kPi * kPi * (s.ringRadius + s.tubeRadius) * s.tubeRadius; });
}

struct SurfacePoint {
    Point3 position;
    Point3 normal;  // outward, unit length
    bool kept;      // false: rejected; start over with a new part
};

SurfacePoint drawOn(const SolidSphere& s, Random& random) {
    const Point3 u = randomDirection(random);
    return {s.radius * u, u, true};
}

// Stretching the unit sphere to the ellipsoid enlarges area by abc |(x/a, y/b, z/c)| in direction (x, y, z).
// The maximum, abc / min(a, b, c), gives the envelope.
SurfacePoint drawOn(const SolidEllipsoid& s, Random& random) {
    const Point3& a = s.semiAxes;
    const Point3 u = randomDirection(random);
    const Point3 gradient{u.x / a.x, u.y / a.y, u.z / a.z};
    const double size = length(gradient);
    const bool kept = random.uniform() < size * smallest(a);
    return {{a.x * u.x, a.y * u.y, a.z * u.z}, (1.0 / size) * gradient, kept};
}

// The two round ends make one sphere, whose points move to the end they belong to.
SurfacePoint drawOn(const SolidCapsule& s, Random& random) {
    if (random.uniform() * (s.radius + s.halfLength) < s.radius) {
        const Point3 u = randomDirection(random);
        return {s.radius * u + Point3{0.0, 0.0, std::copysign(s.halfLength, u.z)}, u, true};
    }
    const double angle = random.uniform(0.0, 2.0 * kPi);
    const Point3 u{std::cos(angle), std::sin(angle), 0.0};
    return {s.radius * u + Point3{0.0, 0.0, random.uniform(-s.halfLength, s.halfLength)}, u, true};
}

SurfacePoint drawOn(const SolidTube& s, Random& random) {
    const double outer = 2.0 * s.radius * s.halfLength;
    const double inner = 2.0 * s.innerRadius * s.halfLength;
    const double ends = s.radius * s.radius - s.innerRadius * s.innerRadius;
    const double pick = random.uniform() * (outer + inner + ends);
    const double angle = random.uniform(0.0, 2.0 * kPi);
    const Point3 u{std::cos(angle), std::sin(angle), 0.0};
    if (pick < outer + inner) {
        const Point3 up{0.0, 0.0, random.uniform(-s.halfLength, s.halfLength)};
        if (pick < outer) return {s.radius * u + up, u, true};
        return {s.innerRadius * u + up, -1.0 * u, true};
    }
    const double radial = std::sqrt(s.innerRadius * s.innerRadius + ends * random.uniform());
    const double side = random.below(2) == 0 ? -1.0 : 1.0;
    return {radial * u + Point3{0.0, 0.0, side * s.halfLength}, {0.0, 0.0, side}, true};
}

SurfacePoint drawOn(const SolidBox& s, Random& random) {
    const std::array<double, 3> h = {s.halfSides.x, s.halfSides.y, s.halfSides.z};
    const std::array<double, 3> area = {h[1] * h[2], h[2] * h[0], h[0] * h[1]};
    const double pick = random.uniform() * (area[0] + area[1] + area[2]);
    const std::size_t axis = pick < area[0] ? 0 : pick < area[0] + area[1] ? 1 : 2;
    std::array<double, 3> position{};
    std::array<double, 3> normal{};
    for (std::size_t i = 0; i < 3; ++i) position[i] = random.uniform(-h[i], h[i]);
    normal[axis] = random.below(2) == 0 ? -1.0 : 1.0;
    position[axis] = normal[axis] * h[axis];
    return {{position[0], position[1], position[2]}, {normal[0], normal[1], normal[2]}, true};
}

// Uniform angles alone would crowd the inside of the ring, where the area per angle is smallest.
SurfacePoint drawOn(const SolidTorus& s, Random& random) {
    const double ring = random.uniform(0.0, 2.0 * kPi);
    const double tube = random.uniform(0.0, 2.0 * kPi);
    const double radial = s.ringRadius + s.tubeRadius * std::cos(tube);
    const bool kept = random.uniform() * (s.ringRadius + s.tubeRadius) < radial;
    const Point3 u{std::cos(ring), std::sin(ring), 0.0};
    return {radial * u + Point3{0.0, 0.0, s.tubeRadius * std::sin(tube)},
            std::cos(tube) * u + Point3{0.0, 0.0, std::sin(tube)}, kept};
}

// A part with its inverse placement, for repeated queries.
struct PlacedPart {
    const SolidPart* part;
    Motion toLocal;

    bool contains(const Point3& p) const { return localImplicit(part->shape, apply(toLocal, p)) <= 0.0; }
};

std::vector<PlacedPart> placeParts(const Solid& solid) {
    std::vector<PlacedPart> placed;
    placed.reserve(solid.parts.size());
    for (const SolidPart& part : solid.parts) placed.push_back({&part, inverse(part.placement)});
    return placed;
}

bool isOnUnionBoundary(const std::vector<PlacedPart>& parts, std::size_t own, const Point3& outside,
                       const Point3& inside) {
    for (std::size_t j = 0; j < parts.size(); ++j) {
        if (j == own) continue;
        if (parts[j].contains(outside)) return false;
        // Inside but not outside: an earlier part has the same face, and these points are its own.
        if (j < own && parts[j].contains(inside)) return false;
    }
    return true;
}

}  // namespace

Result<void> checkSolid(const Solid& solid) {
    if (solid.parts.empty()) return fail(ErrorCode::kInvalidArgument, "the solid has no parts");
    for (std::size_t i = 0; i < solid.parts.size(); ++i) {
        if (!hasValidLengths(solid.parts[i].shape)) {
            return fail(ErrorCode::kInvalidArgument,
                        "part " + std::to_string(i) + " of the solid has a length outside its range");
        }
        if (!isValidPlacement(solid.parts[i].placement)) {
            return fail(ErrorCode::kInvalidArgument,
                        "part " + std::to_string(i) +
                            " of the solid has a placement that is not a similarity motion");
        }
    }
    return {};
}

double implicitValue(const SolidPart& part, const Point3& p) {
    return localImplicit(part.shape, apply(inverse(part.placement), p));
}

bool contains(const Solid& solid, const Point3& p) {
    return std::any_of(solid.parts.begin(), solid.parts.end(),
                       [&](const SolidPart& part) { return implicitValue(part, p) <= 0.0; });
}

Box boundsOf(const Solid& solid) {
    Box bounds;
    for (const SolidPart& part : solid.parts) {
        const auto& r = part.placement.rotation;
        // Row k of R is the k-th axis of the solid seen from the part's own frame.
        const auto half = [&](std::size_t k) {
            return part.placement.scale * reach(part.shape, {r[k][0], r[k][1], r[k][2]});
        };
        const Point3 extent{half(0), half(1), half(2)};
        bounds.add({part.placement.translation - extent, part.placement.translation + extent});
    }
    return bounds;
}

double thinnestPart(const Solid& solid) {
    double thinnest = 0.0;
    for (std::size_t i = 0; i < solid.parts.size(); ++i) {
        const double own = solid.parts[i].placement.scale * thickness(solid.parts[i].shape);
        thinnest = i == 0 ? own : std::min(thinnest, own);
    }
    return thinnest;
}

Result<PointCloud> sampleBoundary(const Solid& solid, std::size_t count, std::uint64_t seed) {
    RETURN_IF_ERROR(checkSolid(solid));
    if (count == 0) {
        return fail(ErrorCode::kInvalidArgument, "the number of points to sample must be at least 1");
    }
    const std::vector<PlacedPart> parts = placeParts(solid);
    std::vector<double> sums;
    double total = 0.0;
    for (const SolidPart& part : solid.parts) {
        total += part.placement.scale * part.placement.scale * envelopeArea(part.shape);
        sums.push_back(total);
    }
    const double probe = kProbeShare * boundsOf(solid).diagonal();
    Random random(seed);
    PointCloud points;
    points.reserve(count);
    // A thousand points are added so that small counts do not fail by bad luck.
    const std::size_t trials = kTrialsPerPoint * (count + 1000);
    for (std::size_t trial = 0; trial < trials && points.size() < count; ++trial) {
        const auto at = std::upper_bound(sums.begin(), sums.end(), random.uniform() * total);
        const auto own = std::min(static_cast<std::size_t>(at - sums.begin()), sums.size() - 1);
        const Motion& placement = solid.parts[own].placement;
        const SurfacePoint drawn =
            std::visit([&](const auto& shape) { return drawOn(shape, random); }, solid.parts[own].shape);
        if (!drawn.kept) continue;
        const Point3 position = apply(placement, drawn.position);
        const Point3 step = probe * rotate(placement.rotation, drawn.normal);
        if (isOnUnionBoundary(parts, own, position + step, position - step)) points.push_back(position);
    }
    if (points.size() < count) {
        return fail(ErrorCode::kInvalidArgument,
                    "hardly any of the parts' surfaces is on the boundary of the solid; drop hidden parts");
    }
    return points;
}

double volumeOf(const Solid& solid, std::size_t samples) {
    if (samples == 0 || solid.parts.empty()) return 0.0;
    const std::vector<PlacedPart> parts = placeParts(solid);
    const Box bounds = boundsOf(solid);
    const Point3 side = bounds.extent();
    // An additive recurrence with powers of 1/g as steps, where g^4 = g + 1 (Roberts 2018).
    constexpr double kG = 1.22074408460575947536;
    const Point3 advance{1.0 / kG, 1.0 / (kG * kG), 1.0 / (kG * kG * kG)};
    const auto fraction = [](double x) { return x - std::floor(x); };
    std::size_t inside = 0;
    for (std::size_t i = 0; i < samples; ++i) {
        const double n = static_cast<double>(i) + 0.5;
        const Point3 p{bounds.low.x + side.x * fraction(0.5 + n * advance.x),
                       bounds.low.y + side.y * fraction(0.5 + n * advance.y),
                       bounds.low.z + side.z * fraction(0.5 + n * advance.z)};
        const bool hit =
            std::any_of(parts.begin(), parts.end(), [&](const PlacedPart& part) { return part.contains(p); });
        inside += hit ? 1 : 0;
    }
    return side.x * side.y * side.z * static_cast<double>(inside) / static_cast<double>(samples);
}

}  // namespace shapedb
