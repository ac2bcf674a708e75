// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/wire.h"

#include "core/signature/signature_codec.h"

namespace shapedb::wire {

namespace {

void toProto(const ShapeAttributes& attributes, v1::ShapeAttributes* out) {
    out->set_quality(attributes.quality / 255.0);
    for (const StatisticLayout& layout : kStatistics) {
        v1::ShapeStatistic* statistic = out->add_statistics();
        statistic->set_name(layout.name);
        statistic->set_of_interior(layout.evidence == Evidence::kInside);
        for (std::size_t i = layout.offset; i < std::size_t{layout.offset} + layout.count; ++i) {
            statistic->add_shares(static_cast<float>(shareOfLevel(attributes.statistics[i])));
        }
    }
}

}  // namespace

void toProto(const Signature& signature, v1::Signature* out) {
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        const WeightedPoint& point = signature.points[i];
        v1::WeightedPoint* weighted = out->add_points();
        toProto(pointPosition(signature, i), weighted->mutable_position());
        weighted->set_weight(pointVolume(signature, i));
        weighted->set_volume_share(point.volumeShare);
        weighted->set_peak_radius(static_cast<double>(point.maximumRadius) * signature.scale);
        for (const double extent : pointExtents(signature, i)) weighted->add_extents(extent);
    }
    out->set_scale(signature.scale);
    out->set_volume(signature.volume);
    out->set_encoded(encodeSignature(signature));
    if (signature.attributes) toProto(*signature.attributes, out->mutable_attributes());
}

void toProto(const Segmentation& segmentation, v1::SegmentationReport* out) {
    out->set_points(segmentation.siteOfPoint.size());
    out->set_points_used(segmentation.sites.size());
    out->set_duplicates(segmentation.duplicates);
    out->set_outliers(segmentation.outliers);
    out->set_outlier_clusters(segmentation.outlierClusters);
    out->set_quality(segmentation.quality);
    out->set_interior_source(toProto(segmentation.interiorSource));
    out->set_angle_degrees(segmentation.angleDegrees);
    out->set_noise(segmentation.noise);
    out->set_doubt(toProto(segmentation.doubt));
    out->set_tetrahedra(segmentation.tetrahedra.size());
    out->set_interior_tetrahedra(segmentation.interiorTetrahedra);
    out->set_maxima(segmentation.maxima);
    out->set_segments(segmentation.segments.size());
    out->set_volume(segmentation.volume);
    out->set_delaunay_seconds(segmentation.delaunaySeconds);
    out->set_total_seconds(segmentation.totalSeconds);
    for (const StageTime& stage : segmentation.stages) {
        v1::StageTime* time = out->add_stages();
        time->set_stage(stage.stage);
        time->set_seconds(stage.seconds);
    }
}

namespace {

void fillMotion(const Motion& motion, v1::Motion* out) {
    for (const auto& row : motion.rotation) {
        for (const double entry : row) out->add_rotation(entry);
    }
    out->set_scale(motion.scale);
    shapedb::wire::toProto(motion.translation, out->mutable_translation());
    out->set_reflected(motion.reflected);
}

void fillPose(const FitPose& pose, v1::FitPose* out) {
    fillMotion(pose.motion, out->mutable_motion());
    out->set_score(pose.score);
    out->set_explained_query(pose.explainedQuery);
    out->set_explained_other(pose.explainedOther);
    out->set_residual(pose.residual);
}

v1::FitKind kindOf(FitKind kind) {
    switch (kind) {
        case FitKind::kWhole: return v1::FIT_KIND_WHOLE;
        case FitKind::kOneSided: return v1::FIT_KIND_ONE_SIDED;
        case FitKind::kPiece: return v1::FIT_KIND_PIECE;
    }
    return v1::FIT_KIND_WHOLE;
}

}  // namespace

void toProto(const Explanation& explanation, v1::Explanation* out) {
    out->set_similarity(explanation.similarity);
    out->set_dissimilarity(explanation.dissimilarity);
    fillMotion(explanation.motion, out->mutable_motion());
    for (const PointMatch& match : explanation.matches) {
        v1::SegmentMatch* pair = out->add_matches();
        pair->set_query_segment(match.a);
        pair->set_hit_segment(match.b);
        pair->set_share(match.share);
        pair->set_distance(match.distance);
    }
    for (const std::uint32_t segment : explanation.unmatchedA) out->add_unmatched_query(segment);
    for (const std::uint32_t segment : explanation.unmatchedB) out->add_unmatched_hit(segment);
    out->set_degenerate(explanation.degenerate);
    for (const ScoreTerm& term : explanation.terms) {
        v1::ScoreTerm* part = out->add_terms();
        part->set_name(term.name);
        part->set_distance(term.distance);
        part->set_weight(term.weight);
    }
}

void toProto(const FitResult& fit, v1::Fit* out) {
    fillPose(fit.best, out->mutable_best());
    out->set_kind(kindOf(fit.kind));
    out->set_misfit(fit.misfit);
    out->set_certainty(fit.certainty);
    out->set_left_right_open(fit.handednessOpen);
    for (const FitPose& pose : fit.alternatives) fillPose(pose, out->add_alternatives());
    for (const FreeAxis& axis : fit.axes) {
        v1::FreeAxis* line = out->add_axes();
        toProto(axis.point, line->mutable_point());
        toProto(axis.direction, line->mutable_direction());
    }
}

void toProto(const ShapeParameters& parameters, v1::SegmentationParameters* segmentation,
             v1::SignatureParameters* signature) {
    segmentation->set_big_ball_ratio(parameters.segmentation.bigBallRatio);
    segmentation->set_deep_angle_degrees(parameters.segmentation.deepAngleDegrees);
    segmentation->set_hull_angle_degrees(parameters.segmentation.hullAngleDegrees);
    segmentation->set_merge_ratio(parameters.segmentation.mergeRatio);
    segmentation->set_decimate_to(parameters.segmentation.preparation.decimateTo);
    segmentation->set_merge_contrast(parameters.segmentation.mergeContrast);
    segmentation->set_min_segment_share(parameters.segmentation.minSegmentShare);
    segmentation->set_max_segments(parameters.segmentation.maxSegments);
    segmentation->set_outlier_ratio(parameters.segmentation.preparation.outlierRatio);
    segmentation->set_smoothing_reach(parameters.segmentation.preparation.smoothingReach);
    segmentation->set_thinning(parameters.segmentation.preparation.thinning);
    segmentation->set_interior_method(toProto(parameters.segmentation.interiorMethod));
    signature->set_max_points(parameters.signature.maxPoints);
    signature->set_attributes(parameters.signature.attributes);
    signature->set_views(parameters.views);
    signature->set_unit(toProto(parameters.unit));
}

}  // namespace shapedb::wire
