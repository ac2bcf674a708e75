// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/fit_output.h"

#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/cli/shape_output.h"
#include "client/cli/text.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

const char* kindName(client::FitKind kind) {
    switch (kind) {
        case client::FitKind::kWhole: return "whole";
        case client::FitKind::kOneSided: return "one-sided";
        case client::FitKind::kPiece: return "piece";
    }
    return "whole";
}

json poseJson(const client::FitPose& pose) {
    return {{"matrix", matrixOf(pose.motion)},
            {"score", pose.score},
            {"residual", pose.residual},
            {"explained_query", pose.explainedQuery},
            {"explained_other", pose.explainedOther},
            {"reflected", pose.motion.reflected},
            {"scale", pose.motion.scale}};
}

json arrayOf(const Point3& p) { return json::array({p.x, p.y, p.z}); }

std::string certaintyText(const client::Fit& fit) {
    std::string text;
    if (fit.handednessOpen) text += "The points do not tell left from right.\n";
    if (fit.axes.size() == 1) {
        text += "Any turn about the axis through " + formatPoint(fit.axes.front().point) + " along " +
                formatPoint(fit.axes.front().direction) + " fits as well.\n";
    } else if (!fit.axes.empty()) {
        text += "It may be turned any way.\n";
    }
    if (!fit.alternatives.empty()) {
        text += formatCount(fit.alternatives.size(), "other pose fits", "other poses fit") + " as well.\n";
    }
    return text;
}

}  // namespace

std::array<double, 16> matrixOf(const Motion& motion) {
    std::array<double, 16> matrix{};
    const double translation[3] = {motion.translation.x, motion.translation.y, motion.translation.z};
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            matrix[4 * row + column] = motion.scale * motion.rotation[row][column];
        }
        matrix[4 * row + 3] = translation[row];
    }
    matrix[15] = 1.0;
    return matrix;
}

std::string matrixText(const Motion& motion) {
    const std::array<double, 16> matrix = matrixOf(motion);
    std::string text;
    for (std::size_t i = 0; i < matrix.size(); ++i)
        text += exactNumber(matrix[i]) + (i % 4 == 3 ? "\n" : " ");
    return text;
}

json toJson(const client::Fit& fit) {
    json document = poseJson(fit.best);
    document["kind"] = kindName(fit.kind);
    document["misfit"] = fit.misfit;
    document["certainty"] = fit.certainty;
    document["left_right_open"] = fit.handednessOpen;
    document["alternatives"] = json::array();
    for (const client::FitPose& pose : fit.alternatives) document["alternatives"].push_back(poseJson(pose));
    document["free_axes"] = json::array();
    for (const client::FreeAxis& axis : fit.axes) {
        document["free_axes"].push_back(
            {{"point", arrayOf(axis.point)}, {"direction", arrayOf(axis.direction)}});
    }
    return document;
}

std::string fitMotionText(const Motion& motion, const std::string& name) {
    std::string text = name + " is " + (motion.reflected ? "mirrored, " : "") + "turned by " +
                       formatFixed(rotationDegrees(motion), 0) + " degrees";
    if (std::abs(motion.scale - 1.0) >= 5e-4) text += ", scaled by " + formatNumber(motion.scale);
    return text + " and moved by " + formatPoint(motion.translation) + ".\n";
}

namespace {

std::string verdictText(Verdict verdict, const std::string& part) {
    switch (verdict) {
        case Verdict::kNone: return "";
        case Verdict::kSameObject: return "same object";
        case Verdict::kSameObjectBent: return "same object, bent";
        case Verdict::kPart: return part;
        case Verdict::kSameKind: return "same kind";
        case Verdict::kUnrelated: return "unrelated";
    }
    return "";
}

}  // namespace

std::string likenessText(Verdict verdict, std::optional<bool> mirrored, const std::string& part) {
    const std::string text = verdictText(verdict, part);
    // Of different objects neither is the mirror image of the other.
    const bool different = verdict == Verdict::kSameKind || verdict == Verdict::kUnrelated;
    if (!mirrored.value_or(false) || different) return text;
    return text.empty() ? "mirrored" : text + ", mirrored";
}

json mirroredJson(std::optional<bool> mirrored) { return mirrored ? json(*mirrored) : json(nullptr); }

std::string mirroredCell(std::optional<bool> mirrored) { return !mirrored ? "" : *mirrored ? "1" : "0"; }

json verdictJson(Verdict verdict) {
    return verdict == Verdict::kNone ? json(nullptr) : json(verdictName(verdict));
}

std::string verdictCell(Verdict verdict) { return verdict == Verdict::kNone ? "" : verdictName(verdict); }

std::string fitText(const client::Fit& fit, const std::string& queryName, const std::string& otherName) {
    const client::FitPose& best = fit.best;
    std::string text = formatPercent(best.explainedQuery) + " of " + queryName + " lies on " + otherName +
                       ", " + formatPercent(best.explainedOther) + " of what " + queryName +
                       " should show of it is there";
    if (fit.kind == client::FitKind::kOneSided)
        text += "; " + queryName + " is taken for a scan from one side";
    if (fit.kind == client::FitKind::kPiece) text += "; " + queryName + " is taken for a piece";
    text += ".\nWhere they meet, they are " + formatPercent(best.residual) + " of the size of " + queryName +
            " apart.\n";
    return text + certaintyText(fit);
}

}  // namespace shapedb::cli
