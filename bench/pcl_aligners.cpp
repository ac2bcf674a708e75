// SPDX-License-Identifier: GPL-3.0-or-later
// Registration as users of the Point Cloud Library and of Open3D do it; docs/fit.md gives the settings.
#include <exception>
#include <new>
#include <string>
#include <utility>

#include <pcl/common/transforms.h>
#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <pcl/registration/ia_ransac.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/sample_consensus_prerejective.h>
#include <pcl/search/kdtree.h>

#include "bench/peers.h"
#include "core/geometry/box.h"

namespace shapedb::bench {

namespace {

using Plain = pcl::PointCloud<pcl::PointXYZ>;
using NormalCloud = pcl::PointCloud<pcl::PointNormal>;
using Features = pcl::PointCloud<pcl::FPFHSignature33>;

// The proportions of Open3D's tutorial on global registration. A voxel is 2 % of the other's diagonal.
constexpr double kVoxel = 0.02;
constexpr double kNormalVoxels = 2.0;    // voxels
constexpr double kFeatureVoxels = 5.0;   // voxels
constexpr double kWithin = 1.5;          // voxels: distance of a correspondence
constexpr float kSampleDistance = 5.0F;  // voxels
constexpr int kSacIterations = 1000;
constexpr int kRansacIterations = 50000;
constexpr float kSimilarity = 0.9F;  // of edges, as in PCL's tutorial and Open3D's
constexpr float kInliers = 0.25F;    // of the query's points, as in PCL's tutorial

struct Prepared {
    NormalCloud::Ptr points;
    Features::Ptr features;
};

// In units of a voxel about `centre`, for single precision.
Prepared prepare(const PointCloud& points, const Point3& centre, double voxel) {
    auto plain = pcl::make_shared<Plain>();
    for (const Point3& p : points) {
        const Point3 q = (1.0 / voxel) * (p - centre);
        plain->emplace_back(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z));
    }
    Plain reduced;
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    grid.setLeafSize(1.0F, 1.0F, 1.0F);
    grid.setInputCloud(plain);
    grid.filter(reduced);
    Prepared made{pcl::make_shared<NormalCloud>(), pcl::make_shared<Features>()};
    pcl::copyPointCloud(reduced, *made.points);
    pcl::NormalEstimation<pcl::PointNormal, pcl::PointNormal> normals;
    normals.setInputCloud(made.points);
    normals.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointNormal>>());
    normals.setRadiusSearch(kNormalVoxels);
    // Of a closed shape seen from its centre all normals point inwards, of a scan of one side nearly so.
    normals.setViewPoint(0.0F, 0.0F, 0.0F);
    normals.compute(*made.points);
    pcl::FPFHEstimation<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> features;
    features.setInputCloud(made.points);
    features.setInputNormals(made.points);
    features.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointNormal>>());
    features.setRadiusSearch(kFeatureVoxels);
    features.compute(*made.features);
    return made;
}

// The motion that `search` finds, of the query onto the other shape.
template <typename Search>
Eigen::Matrix4f found(Search& search, const Prepared& query, const Prepared& other) {
    search.setInputSource(query.points);
    search.setSourceFeatures(query.features);
    search.setInputTarget(other.points);
    search.setTargetFeatures(other.features);
    search.setMaxCorrespondenceDistance(kWithin);
    NormalCloud moved;
    search.align(moved);
    return search.getFinalTransformation();
}

Eigen::Matrix4f sampleConsensus(const Prepared& query, const Prepared& other) {
    pcl::SampleConsensusInitialAlignment<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> search;
    search.setMinSampleDistance(kSampleDistance);
    search.setMaximumIterations(kSacIterations);
    return found(search, query, other);
}

Eigen::Matrix4f prerejective(const Prepared& query, const Prepared& other) {
    pcl::SampleConsensusPrerejective<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> search;
    search.setMaximumIterations(kRansacIterations);
    search.setNumberOfSamples(3);
    search.setCorrespondenceRandomness(5);
    search.setSimilarityThreshold(kSimilarity);
    search.setInlierFraction(kInliers);
    return found(search, query, other);
}

Eigen::Matrix4f refined(const Prepared& query, const Prepared& other, const Eigen::Matrix4f& start) {
    pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
    icp.setInputSource(query.points);
    icp.setInputTarget(other.points);
    icp.setMaxCorrespondenceDistance(kWithin);
    icp.setMaximumIterations(50);
    NormalCloud moved;
    icp.align(moved, start);
    return icp.getFinalTransformation();
}

// `matrix` takes the query to the other shape, both in voxels about their centres.
Motion motionOf(const Eigen::Matrix4f& matrix, const Point3& queryCentre, const Point3& otherCentre,
                double voxel) {
    Motion motion;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            motion.rotation[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] =
                static_cast<double>(matrix(row, column));
        }
    }
    const Point3 shift = {static_cast<double>(matrix(0, 3)), static_cast<double>(matrix(1, 3)),
                          static_cast<double>(matrix(2, 3))};
    motion.translation = otherCentre + voxel * shift - rotate(motion.rotation, queryCentre);
    return inverse(motion);
}

PeerAligner aligner(std::string name, Eigen::Matrix4f (*search)(const Prepared&, const Prepared&)) {
    return {std::move(name), [search](const PointCloud& query, const PointCloud& other) -> Result<Motion> {
                try {
                    const Box box = boxOf(query);
                    const Box otherBox = boxOf(other);
                    const double voxel = kVoxel * otherBox.diagonal();
                    const Point3 centre = 0.5 * (box.low + box.high);
                    const Point3 otherCentre = 0.5 * (otherBox.low + otherBox.high);
                    const Prepared a = prepare(query, centre, voxel);
                    const Prepared b = prepare(other, otherCentre, voxel);
                    return motionOf(refined(a, b, search(a, b)), centre, otherCentre, voxel);
                } catch (const std::bad_alloc&) {
                    return fail(ErrorCode::kOutOfMemory, "not enough memory");
                } catch (const std::exception& e) {
                    return fail(ErrorCode::kInternal, std::string("registration: ") + e.what());
                }
            }};
}

}  // namespace

std::vector<PeerAligner> peerAligners() {
    return {aligner("FPFH, SAC-IA, ICP", sampleConsensus), aligner("FPFH, RANSAC, ICP", prerejective)};
}

}  // namespace shapedb::bench
