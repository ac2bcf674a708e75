// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/interior_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <Eigen/Eigenvalues>

#include "core/base/random.h"
#include "core/geometry/tetrahedron.h"
#include "core/signature/covariance.h"

namespace shapedb {

namespace {

constexpr std::uint64_t kPairSeed = 2004;  // the year of the paper; any number does
// Once drawn for samples of the interior. The pairs drawn after them, and so the statistics in stored
// signatures, depend on where the stream stands.
constexpr std::size_t kPassedOver = 8192;

struct PrincipalFrame {
    Point3 centre;
    std::array<Point3, 3> axes;  // by falling spread
};

// Centroid and principal axes of the interior, from the segments' moments.
PrincipalFrame principalFrame(const Segmentation& segmentation) {
    PrincipalFrame frame;
    for (const Segment& segment : segmentation.segments) {
        frame.centre = frame.centre + (segment.volume / segmentation.volume) * segment.centroid;
    }
    // The moments of the whole are those within the segments and those of the segments' centroids.
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    const double unit = 1.0 / segmentation.size;
    for (const Segment& segment : segmentation.segments) {
        const double share = segment.volume / segmentation.volume;
        const Point3 d = unit * (segment.centroid - frame.centre);
        const Eigen::Vector3d v(d.x, d.y, d.z);
        moments += share * (covarianceMatrix(segment.covariance) * (unit * unit) + v * v.transpose());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d u = solver.eigenvectors().col(2 - axis);
        frame.axes[static_cast<std::size_t>(axis)] = {u[0], u[1], u[2]};
    }
    return frame;
}

void takeTetrahedra(const Segmentation& segmentation, InteriorView& view) {
    const Tetrahedra& all = segmentation.tetrahedra;
    // All numbers first, since a neighbour may come later.
    std::vector<std::uint32_t> index(all.size(), kNoTetrahedron);
    std::uint32_t count = 0;
    for (std::size_t t = 0; t < all.size(); ++t) {
        if (segmentation.tetrahedronSegment[t] >= 0) index[t] = count++;
    }
    view.vertices.reserve(count);
    view.neighbours.reserve(count);
    view.volumes.reserve(count);
    view.centroids.reserve(count);
    view.radii.reserve(count);
    for (std::size_t t = 0; t < all.size(); ++t) {
        if (index[t] == kNoTetrahedron) continue;
        const auto& v = all.vertices[t];
        std::array<std::uint32_t, 4> neighbours;
        for (std::size_t f = 0; f < 4; ++f) {
            const std::uint32_t other = all.neighbours[t][f];
            neighbours[f] = other == kNoTetrahedron ? kNoTetrahedron : index[other];
        }
        const TetrahedronCorners corners = cornersOf(view.sites, v);
        view.vertices.push_back(v);
        view.neighbours.push_back(neighbours);
        view.volumes.push_back(std::abs(signedVolume(corners)));
        view.centroids.push_back(centroidOf(corners));
        // The ball of a flat tetrahedron may be of any size.
        view.radii.push_back(std::min(1.0, all.circumradii[t] / segmentation.size));
    }
    view.volume = std::accumulate(view.volumes.begin(), view.volumes.end(), 0.0);
}

void takeSurface(InteriorView& view) {
    std::vector<std::uint8_t> touched(view.sites.size(), 0);
    for (const auto& v : view.vertices) {
        for (const std::uint32_t site : v) touched[site] = 1;
    }
    for (std::size_t i = 0; i < touched.size(); ++i) {
        if (touched[i] != 0) view.surface.push_back(view.sites[i]);
    }
}

double meanDistance(const PointCloud& points, Random& random) {
    double sum = 0.0;
    double pairs = 0.0;
    for (std::size_t i = 0; i < InteriorView::kPairs; ++i) {
        const std::size_t a = random.below(points.size());
        const std::size_t b = random.below(points.size());
        if (a == b) continue;
        sum += distance(points[a], points[b]);
        pairs += 1.0;
    }
    return sum / pairs;
}

}  // namespace

InteriorView interiorView(const Segmentation& segmentation) {
    InteriorView view;
    const PrincipalFrame frame = principalFrame(segmentation);
    const double unit = 1.0 / segmentation.size;
    view.sites.reserve(segmentation.sites.size());
    for (const Point3& site : segmentation.sites) {
        const Point3 d = unit * (site - frame.centre);
        view.sites.push_back({dot(d, frame.axes[0]), dot(d, frame.axes[1]), dot(d, frame.axes[2])});
    }
    takeTetrahedra(segmentation, view);
    takeSurface(view);
    Random random(kPairSeed);
    for (std::size_t i = 0; i < kPassedOver; ++i) random.next();
    view.meanSurfaceDistance = meanDistance(view.surface, random);
    for (std::size_t t = 0; t < view.volumes.size(); ++t) {
        view.meanRadius += view.volumes[t] / view.volume * length(view.centroids[t]);
    }
    return view;
}

}  // namespace shapedb
