// SPDX-License-Identifier: GPL-3.0-or-later
// Merging segments by contrast: how much thicker a segment is than the saddle into it. The paper's
// criterion (Section 3.3), but with pairs merged in order of contrast and groups compared as they grow.
// docs/segments.md has the results.
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

/// What merging needs to know about the segments.
struct SegmentGraph {
    std::vector<double> volumes;  ///< per segment, >= 0
    std::vector<double> radii;    ///< per segment, of its largest ball, > 0
    std::vector<SegmentContact> contacts;
};

struct ContrastMerging {
    double contrast = 1.3;           ///< segments merge up to this contrast, >= 1
    double minShare = 0.004;         ///< lighter groups join a neighbour; share of all volume, [0, 1]
    std::uint32_t maxSegments = 16;  ///< so does the lightest while there are more groups; 0: no limit
};

/// Returns the group of each segment; groups are numbered by their first segment.
///
/// The radius of a group is the geometric mean of its segments' radii, weighted by volume. The contrast of
/// two groups is the larger of their radii over the smallest of both radii and their saddle radius. Pairs
/// merge in ascending order of contrast, which is updated as groups grow (once a radius has moved by a
/// thousandth), until every pair is above `options.contrast`. Then light groups, and the lightest of too
/// many, join the neighbour with the largest saddle radius; groups that touch no other stay, however light.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<std::uint32_t>> mergeByContrast(const SegmentGraph& graph,
                                                                 const ContrastMerging& options,
                                                                 const RunContext& context = {});

/// Measures contacts and volumes and merges; the labels are numbered in descending order of maximum.
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<SegmentLabels> mergeSegmentsByContrast(
    const PointCloud& points, const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& flow,
    const SegmentLabels& fine, const ContrastMerging& options, const RunContext& context = {});

}  // namespace shapedb
