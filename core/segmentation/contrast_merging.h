// Merging segments by how much thicker one is than the way into it: the paper's criterion
// (Section 3.3) as a scale along which segments grow together, in place of one threshold.
// docs/segments.md shows what comes out and how stable it is.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"
#include "core/segmentation/contacts.h"
#include "core/segmentation/segments.h"

namespace shapedb {

/// What merging needs to know of the segments.
struct SegmentGraph {
    std::vector<double> volumes;  ///< per segment, >= 0
    std::vector<double> radii;    ///< per segment its maximum, > 0
    std::vector<SegmentContact> contacts;
};

struct ContrastMerging {
    double contrast = 1.3;           ///< segments merge up to this contrast, >= 1
    double minShare = 0.004;         ///< lighter segments join a neighbour, share of all volume, [0, 1]
    std::uint32_t maxSegments = 16;  ///< so do the lightest while there are more than this; 0: no limit
};

/// Groups segments; returns for each the index of its group, dense, groups in the order of their
/// first segment.
///
/// The radius of a group is the mean radius of its segments: geometric, weighted by volume. The
/// contrast of two groups is the larger of their radii over the smallest among their radii and
/// their saddleRadius. Pairs merge by rising contrast, evaluated anew as groups grow (a group's radius
/// may drift by a thousandth before all its pairs are), until every pair is above
/// `options.contrast`. A limb of many maxima is thus one group before its root is compared with
/// the body, and a limb much thinner than the body stays apart however wide its root.
/// Then the lightest group below `minShare`, or above the number, joins the neighbour with the
/// widest saddleRadius; groups that touch no other stay, however light.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<std::uint32_t>> mergeByContrast(const SegmentGraph& graph,
                                                                 const ContrastMerging& options,
                                                                 const RunContext& context = {});

/// contacts, volumes and mergeByContrast in one: the merged labels, dense, by falling maximum.
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<SegmentLabels> mergeSegmentsByContrast(
    const PointCloud& points, const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& flow,
    const SegmentLabels& fine, const ContrastMerging& options, const RunContext& context = {});

}  // namespace shapedb
