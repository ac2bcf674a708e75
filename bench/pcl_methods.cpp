// SPDX-License-Identifier: GPL-3.0-or-later
// ESF, VFH and GASD as users of the Point Cloud Library compute them; docs/benchmarks.md gives the
// settings.
#include <algorithm>
#include <cmath>
#include <new>

#include <Eigen/Eigenvalues>
#include <pcl/common/common.h>
#include <pcl/features/esf.h>
#include <pcl/features/gasd.h>
#include <pcl/features/normal_3d.h>
#include <pcl/features/vfh.h>
#include <pcl/pcl_config.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include "bench/peers.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// Neighbours within this share of the bounding sphere's diameter give a normal.
constexpr double kNormalRadius = 0.04;
/// ESF draws triangles until enough of them have an area. In clouds thinner than this (ratio of standard
/// deviations) none has, and it would never end.
constexpr double kThinnestForEsf = 1e-3;

/// Centred on the mean, for single precision and because VFH takes the origin as its viewpoint; scaled so
/// that the farthest point is at distance 1.
Result<Cloud::Ptr> toCloud(const PointCloud& points) {
    if (points.size() < 4) return fail(ErrorCode::kTooFewPoints, "fewer than 4 points");
    Point3 mean;
    for (const Point3& p : points) mean = mean + p;
    mean = (1.0 / static_cast<double>(points.size())) * mean;
    double farthest = 0.0;
    for (const Point3& p : points) farthest = std::max(farthest, distance(p, mean));
    if (!(farthest > 0.0)) return fail(ErrorCode::kAllPointsEqual, "all points are the same point");
    auto cloud = pcl::make_shared<Cloud>();
    cloud->reserve(points.size());
    for (const Point3& p : points) {
        const Point3 q = (1.0 / farthest) * (p - mean);
        cloud->emplace_back(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z));
    }
    return cloud;
}

bool isALine(const Cloud& cloud) {
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const pcl::PointXYZ& point : cloud) {
        const Eigen::Vector3d p = point.getVector3fMap().cast<double>();
        covariance += p * p.transpose();
    }
    const Eigen::Vector3d variances =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues();
    return std::sqrt(std::max(0.0, variances[1])) < kThinnestForEsf * std::sqrt(variances[2]);
}

template <typename Descriptor>
Result<Histogram> histogramOf(const char* name, const pcl::PointCloud<Descriptor>& result) {
    if (result.size() != 1) {
        return fail(ErrorCode::kInternal, std::string("PCL computed no ") + name + " for this cloud");
    }
    const Histogram histogram(std::begin(result[0].histogram), std::end(result[0].histogram));
    if (!std::all_of(histogram.begin(), histogram.end(), [](float v) { return std::isfinite(v); })) {
        return fail(ErrorCode::kInternal, std::string("PCL computed a ") + name + " that is not finite");
    }
    return histogram;
}

Result<Histogram> esf(const Cloud::Ptr& cloud) {
    if (isALine(*cloud)) return fail(ErrorCode::kCollinear, "all points lie on one line");
    pcl::ESFEstimation<pcl::PointXYZ, pcl::ESFSignature640> estimation;
    estimation.setInputCloud(cloud);
    pcl::PointCloud<pcl::ESFSignature640> result;
    estimation.compute(result);
    return histogramOf("ESF", result);
}

Result<Histogram> vfh(const Cloud::Ptr& cloud) {
    const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
    const auto normals = pcl::make_shared<pcl::PointCloud<pcl::Normal>>();
    pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> normalEstimation;
    normalEstimation.setInputCloud(cloud);
    normalEstimation.setSearchMethod(tree);
    normalEstimation.setRadiusSearch(2.0 * kNormalRadius);  // the sphere has radius 1
    normalEstimation.compute(*normals);
    // A point without neighbours has no normal, and VFH would count it in an arbitrary bin.
    const auto indices = pcl::make_shared<pcl::Indices>();
    for (std::size_t i = 0; i < normals->size(); ++i) {
        if (pcl::isFinite((*normals)[i])) indices->push_back(static_cast<pcl::index_t>(i));
    }
    if (indices->size() < 4) return fail(ErrorCode::kTooFewPoints, "fewer than 4 points have a normal");
    pcl::VFHEstimation<pcl::PointXYZ, pcl::Normal, pcl::VFHSignature308> estimation;
    estimation.setInputCloud(cloud);
    estimation.setInputNormals(normals);
    estimation.setIndices(indices);
    estimation.setSearchMethod(tree);
    // Off by default, but VFH retrieves far better with it, and we measure the alternatives at their best.
    estimation.setNormalizeDistance(true);
    estimation.setFillSizeComponent(true);
    pcl::PointCloud<pcl::VFHSignature308> result;
    estimation.compute(result);
    return histogramOf("VFH", result);
}

Result<Histogram> gasd(const Cloud::Ptr& cloud) {
    pcl::GASDEstimation<pcl::PointXYZ, pcl::GASDSignature512> estimation;
    estimation.setInputCloud(cloud);
    pcl::PointCloud<pcl::GASDSignature512> result;
    estimation.compute(result);
    return histogramOf("GASD", result);
}

/// Turns PCL's exceptions into errors.
std::function<Result<Histogram>(const PointCloud&, std::uint64_t)> guarded(
    Result<Histogram> (*describe)(const Cloud::Ptr&)) {
    return [describe](const PointCloud& points, std::uint64_t) -> Result<Histogram> {
        try {
            const auto cloud = toCloud(points);
            RETURN_IF_ERROR(cloud);
            return describe(*cloud);
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::kOutOfMemory, "not enough memory");
        } catch (const std::exception& e) {
            return fail(ErrorCode::kInternal, std::string("PCL: ") + e.what());
        }
    };
}

}  // namespace

std::vector<Method> peerMethods() {
    return {histogramMethod("esf", "PCL ESF", "L1", l1Distance, guarded(esf)),
            histogramMethod("vfh", "PCL VFH", "chi-square", chiSquareDistance, guarded(vfh)),
            histogramMethod("gasd", "PCL GASD", "L1", l1Distance, guarded(gasd))};
}

std::string peerLibrary() { return "PCL " PCL_VERSION_PRETTY; }

}  // namespace shapedb::bench
