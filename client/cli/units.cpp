// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/units.h"

#include <nlohmann/json.hpp>

#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

void scaleBy(double factor, client::Signature& signature) {
    const double cube = factor * factor * factor;
    for (client::WeightedPoint& point : signature.points) {
        point.position = factor * point.position;
        point.weight *= cube;
        point.maximumRadius *= factor;
        for (double& extent : point.extents) extent *= factor;
    }
    signature.scale *= factor;
    signature.volume *= cube;
}

// With both shapes in the other unit, rotation and scale stay.
void scaleBy(double factor, Motion& motion) { motion.translation = factor * motion.translation; }

}  // namespace

Result<double> factorToCollection(const client::Client& client, const std::string& collection,
                                  std::optional<LengthUnit> unit, const RunContext& context) {
    if (!unit || *unit == LengthUnit::kNone) return 1.0;
    const auto found = client.getCollection(collection, context);
    RETURN_IF_ERROR(found);
    const LengthUnit own = found->parameters.unit.value_or(LengthUnit::kNone);
    if (own == LengthUnit::kNone) {
        return fail(ErrorCode::kInvalidArgument,
                    "--unit: collection '" + found->name +
                        "' has no unit of length; create it with --units, or set it by a rebuild");
    }
    return metresIn(*unit) / metresIn(own);
}

LengthUnit unitOfAnswer(std::optional<LengthUnit> asked, LengthUnit ofCollection) noexcept {
    return asked.value_or(LengthUnit::kNone) == LengthUnit::kNone ? ofCollection : *asked;
}

nlohmann::json unitJson(LengthUnit unit) {
    return unit == LengthUnit::kNone ? nlohmann::json(nullptr) : nlohmann::json(lengthUnitName(unit));
}

Result<bool> sizesOfFilesCount(std::optional<LengthUnit> asked, const ScoreFlags& score) {
    const bool known = asked.value_or(LengthUnit::kNone) != LengthUnit::kNone;
    if (score.freeScale && !known) {
        return fail(
            ErrorCode::kInvalidArgument,
            "--free-scale: files have no unit of length, so sizes do not count unless --unit says it");
    }
    return score.keepScale || (known && !score.freeScale);
}

void scaleBy(double factor, PointCloud& points) {
    for (Point3& point : points) point = factor * point;
}

void scaleBy(double factor, client::Fit& fit) {
    scaleBy(factor, fit.best.motion);
    for (client::FitPose& pose : fit.alternatives) scaleBy(factor, pose.motion);
    for (client::FreeAxis& axis : fit.axes) axis.point = factor * axis.point;
}

void scaleBy(double factor, client::Comparison& comparison) {
    scaleBy(factor, comparison.explanation.motion);
    if (comparison.fit) scaleBy(factor, *comparison.fit);
    scaleBy(factor, comparison.query);
    scaleBy(factor, comparison.other);
}

void scaleBy(double factor, client::SearchReply& reply) {
    const double cube = factor * factor * factor;
    for (client::Hit& hit : reply.hits) {
        if (hit.explanation) scaleBy(factor, hit.explanation->motion);
        if (hit.fit) scaleBy(factor, *hit.fit);
    }
    scaleBy(factor, reply.query);
    if (reply.report) {
        reply.report->volume *= cube;
        reply.report->noise *= factor;
    }
}

}  // namespace shapedb::cli
