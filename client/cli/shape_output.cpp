// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/shape_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <set>

#include <nlohmann/json.hpp>

#include "client/cli/text.h"
#include "common/sha256.h"
#include "core/base/math.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

constexpr double kManyOutliers = 0.05;  // of the points: worth a warning

/// Pairs listed one by one; the rest is counted.
constexpr std::size_t kListedPairs = 3;
/// Pairs that contribute less of the similarity are not worth a line.
constexpr double kShareWorthListing = 0.01;
/// Parts of a pair whose centres are further apart, in units of the common size, do not lie on each other.
constexpr double kElsewhere = 0.1;

json pointJson(const Point3& p) { return json::array({p.x, p.y, p.z}); }

/// "a", "a and b", "a, b and c".
std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (i > 0) text += i + 1 == words.size() ? " and " : ", ";
        text += words[i];
    }
    return text;
}

/// "part 4" or "parts 4, 5 and 7", counted from 1.
std::string partList(const std::vector<std::uint32_t>& indices) {
    std::vector<std::string> numbers;
    for (const std::uint32_t index : indices) numbers.push_back(std::to_string(index + 1));
    return (indices.size() == 1 ? "part " : "parts ") + joined(numbers);
}

double volumeShareOf(const client::Signature& signature, std::uint32_t index) {
    return index < signature.points.size() ? signature.points[index].volumeShare : 0.0;
}

/// The largest pairs, one per line; what adds next to nothing is only counted.
std::string pairsText(const client::Explanation& explanation) {
    std::string text;
    std::size_t listed = 0;
    for (const client::SegmentMatch& match : explanation.matches) {
        if (listed == kListedPairs || (listed > 0 && match.share < kShareWorthListing)) break;
        text += "  part " + std::to_string(match.query + 1) + " <-> part " + std::to_string(match.hit + 1) +
                ": " + formatPercent(match.share) + " of the match, " +
                (match.distance > kElsewhere ? "similar but elsewhere: " : "") + "centres " +
                formatPercent(match.distance) + " apart\n";
        ++listed;
    }
    const std::size_t more = explanation.matches.size() - listed;
    if (more == 0) return text;
    const bool slight = explanation.matches[listed].share < kShareWorthListing;
    return text + "  and " + std::to_string(more) + (slight ? " more below 1 %\n" : " more\n");
}

std::string unmatchedText(const client::Explanation& explanation, const client::Signature& query,
                          const std::string& queryName, const std::string& hitName) {
    std::vector<std::string> sides;
    if (!explanation.unmatchedQuery.empty()) {
        double volume = 0.0;
        for (const std::uint32_t index : explanation.unmatchedQuery) volume += volumeShareOf(query, index);
        sides.push_back(partList(explanation.unmatchedQuery) + " of " + queryName + " (" +
                        formatPercent(volume) + " of its volume)");
    }
    if (!explanation.unmatchedHit.empty()) {
        sides.push_back(partList(explanation.unmatchedHit) + " of " + hitName);
    }
    return sides.empty() ? std::string() : "Unmatched: " + joined(sides) + ".\n";
}

std::string termsText(const client::Explanation& explanation) {
    std::string text;
    for (const client::ScoreTerm& term : explanation.terms) {
        text += (text.empty() ? "" : ", ") + term.name + " " + formatFixed(term.distance, 2);
    }
    return text.empty() ? text
                        : "Differences (0 = identical, 1 = typical of unrelated shapes): " + text + ".\n";
}

std::string motionText(const client::Explanation& explanation, const std::string& hitName) {
    if (explanation.degenerate) return "One of the two is a single part, so any rotation fits.\n";
    const Motion& motion = explanation.motion;
    std::vector<std::string> steps;
    if (motion.reflected) steps.emplace_back("mirrored");
    const std::string degrees = formatFixed(rotationDegrees(motion), 0);
    if (degrees != "0") steps.push_back("turned by " + degrees + " degrees");
    if (std::abs(motion.scale - 1.0) >= 5e-4) steps.push_back("scaled by " + formatNumber(motion.scale));
    if (steps.empty()) return hitName + " is in the same pose.\n";
    return "To match, " + hitName + " is " + joined(steps) + ".\n";
}

}  // namespace

json pointsJson(const client::Signature& signature) {
    json points = json::array();
    for (const client::WeightedPoint& point : signature.points) {
        points.push_back({{"position", pointJson(point.position)},
                          {"weight", point.weight},
                          {"volume_share", point.volumeShare},
                          {"peak_radius", point.maximumRadius},
                          {"extents", point.extents}});
    }
    return points;
}

json statisticsJson(const client::Signature& signature) {
    json statistics = json::object();
    if (!signature.attributes) return statistics;
    for (const client::ShapeStatistic& statistic : signature.attributes->statistics) {
        statistics[statistic.name] = statistic.shares;
    }
    return statistics;
}

json toJson(const client::Signature& signature) {
    json out = {{"points", pointsJson(signature)}, {"scale", signature.scale}, {"volume", signature.volume}};
    if (signature.attributes) out["quality"] = signature.attributes->quality;
    return out;
}

json toJson(const client::SegmentationReport& report) {
    json stages = json::object();
    for (const client::StageTime& stage : report.stages) stages[stage.stage] = stage.seconds;
    return {{"points", report.points},
            {"points_used", report.pointsUsed},
            {"duplicates", report.duplicates},
            {"outliers", report.outliers},
            {"strays", report.outliers},  // the former name
            {"outlier_clusters", report.outlierClusters},
            {"quality", report.quality},
            {"interior_source", interiorSourceName(report.interiorSource)},
            {"doubt", interiorDoubtName(report.doubt)},
            {"angle_degrees", report.angleDegrees},
            {"estimated_noise", report.noise},
            {"tetrahedra", report.tetrahedra},
            {"interior_tetrahedra", report.interiorTetrahedra},
            {"maxima", report.maxima},
            {"segments", report.segments},
            {"volume", report.volume},
            {"delaunay_seconds", report.delaunaySeconds},
            {"total_seconds", report.totalSeconds},
            {"stages", stages}};
}

std::string preparationText(const client::SegmentationReport& report) {
    if (report.pointsUsed == report.points) return {};
    std::vector<std::string> steps;
    if (report.outliers > 0) {
        std::string step = formatCount(report.outliers, "outlier", "outliers") + " dropped";
        if (report.outlierClusters > 0) {
            step += " (with " + formatCount(report.outlierClusters, "separate cluster", "separate clusters") +
                    ")";
        }
        steps.push_back(std::move(step));
    }
    if (report.duplicates > 0) {
        steps.push_back(formatCount(report.duplicates, "duplicate", "duplicates") + " merged");
    }
    if (report.pointsUsed + report.duplicates + report.outliers < report.points) {
        steps.emplace_back("the rest averaged and thinned");
        if (steps.size() == 1) steps = {"averaged and thinned"};
    }
    std::string text = formatCount(report.pointsUsed, "point", "points") + " used: ";
    for (std::size_t i = 0; i < steps.size(); ++i) text += (i > 0 ? ", " : "") + steps[i];
    return text + "\n";
}

std::string qualityText(double quality) {
    const std::string text = "interior quality " + formatFixed(quality, 2) + " of 1";
    if (quality >= kQualityWorthWarning) return text + "\n";
    return text + ": volumes and parts are a guess; scan more sides, or with less noise\n";
}

std::string interiorText(const client::SegmentationReport& report, double scale) {
    std::string text;
    switch (report.interiorSource) {
        case InteriorSource::kWalk:
            text = "interior found by walking in from outside (" + formatNumber(report.angleDegrees) +
                   " degrees)";
            break;
        case InteriorSource::kPotential: text = "interior estimated: the scan is open or noisy"; break;
        case InteriorSource::kThickened:
            text = "no interior found: took the surroundings of the points";
            break;
    }
    if (report.noise > 0.0 && scale > 0.0) {
        const std::string noise = "noise about " + formatPercent(report.noise / scale) + " of the size";
        text += report.interiorSource == InteriorSource::kWalk ? ", " + noise : " (" + noise + ")";
    }
    text += "\n" + qualityText(report.quality);
    switch (report.doubt) {
        case InteriorDoubt::kNone: break;
        case InteriorDoubt::kNoSurface:
            text += "the points show no surface: they fill space, or the noise is as thick as the parts\n";
            break;
        case InteriorDoubt::kThinWalls:
            text += "walls are as thin as the points resolve: scan more densely, or with less noise\n";
            break;
        case InteriorDoubt::kFewPoints:
            text += "few points: walls and hollows may have been missed; scan more densely\n";
            break;
    }
    const double dropped = static_cast<double>(report.outliers) / static_cast<double>(report.points);
    if (report.points > 0 && dropped > kManyOutliers) {
        text += formatFixed(100.0 * dropped, 0) +
                " % of the points were dropped as outliers: parts of the shape may be missing\n";
    }
    return text;
}

json toJson(const client::Explanation& explanation) {
    json matches = json::array();
    for (const client::SegmentMatch& match : explanation.matches) {
        matches.push_back({{"query", match.query},
                           {"hit", match.hit},
                           {"share", match.share},
                           {"distance", match.distance},
                           {"elsewhere", match.distance > kElsewhere}});
    }
    json terms = json::array();
    for (const client::ScoreTerm& term : explanation.terms) {
        terms.push_back({{"name", term.name}, {"distance", term.distance}, {"weight", term.weight}});
    }
    const Motion& motion = explanation.motion;
    return {{"similarity", explanation.similarity},
            {"dissimilarity", explanation.dissimilarity},
            {"motion",
             {{"rotation", motion.rotation},
              {"rotation_degrees", rotationDegrees(motion)},
              {"scale", motion.scale},
              {"translation", pointJson(motion.translation)},
              {"reflected", motion.reflected}}},
            {"matches", matches},
            {"unmatched_query", explanation.unmatchedQuery},
            {"unmatched_hit", explanation.unmatchedHit},
            {"degenerate", explanation.degenerate},
            {"terms", terms}};
}

json toJson(const client::Shape& shape) {
    json out = {{"collection", shape.collection},
                {"key", shape.key},
                {"id", shape.id},
                {"version", shape.version},
                {"state", client::stateName(shape.state)},
                {"points", shape.pointCount},
                {"sha256", toHex(shape.sha256.data(), shape.sha256.size())},
                {"metadata", shape.metadata},
                {"created", timeText(shape.created)},
                {"updated", timeText(shape.updated)}};
    if (shape.failure) {
        out["failure"] = {{"name", errorCodeName(shape.failure->code)}, {"message", shape.failure->message}};
    }
    if (shape.origin != Point3{}) out["origin"] = {shape.origin.x, shape.origin.y, shape.origin.z};
    if (shape.quality) out["quality"] = *shape.quality;
    if (shape.change != 0) out["change"] = shape.change;
    return out;
}

std::string signatureTable(const client::Signature& signature) {
    Table table({{"part", Table::Align::kRight},
                 {"share", Table::Align::kRight},
                 {""},
                 {"volume", Table::Align::kRight},
                 {"radius", Table::Align::kRight},
                 {"position"}});
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        const client::WeightedPoint& point = signature.points[i];
        table.add({std::to_string(i + 1), formatPercent(point.volumeShare), bar(point.volumeShare, 12),
                   formatNumber(point.weight), formatNumber(point.maximumRadius),
                   formatPoint(point.position)});
    }
    return table.render();
}

std::string statisticsTable(const client::Signature& signature) {
    static constexpr std::array<const char*, 9> kHeights = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
    if (!signature.attributes) return {};
    Table table({{"statistic"}, {"distribution"}});
    for (const client::ShapeStatistic& statistic : signature.attributes->statistics) {
        const auto largest = std::max_element(statistic.shares.begin(), statistic.shares.end());
        std::string spread;
        for (const float share : statistic.shares) {
            // Roots, as the score compares them, so that rare bins stay visible.
            const double height = *largest > 0.0f ? std::sqrt(share / *largest) : 0.0;
            spread += kHeights[static_cast<std::size_t>(std::lround(8.0 * std::clamp(height, 0.0, 1.0)))];
        }
        table.add({statistic.name, spread});
    }
    return table.render();
}

double rotationDegrees(const Motion& motion) {
    const double trace = motion.rotation[0][0] + motion.rotation[1][1] + motion.rotation[2][2];
    const double cosine = motion.reflected ? (trace + 1.0) / 2.0 : (trace - 1.0) / 2.0;
    return toDegrees(std::acos(std::clamp(cosine, -1.0, 1.0)));
}

std::string explanationText(const client::Explanation& explanation, const client::Signature& query,
                            const std::string& queryName, const std::string& hitName) {
    if (explanation.matches.empty()) {
        return "no part of " + queryName + " matches a part of " + hitName + "\n" + termsText(explanation);
    }
    std::set<std::uint32_t> matched;
    for (const auto& match : explanation.matches) matched.insert(match.query);
    double matchedVolume = 0.0;
    for (const std::uint32_t index : matched) matchedVolume += volumeShareOf(query, index);
    return formatCount(matched.size()) + " of " + formatCount(query.points.size(), "part", "parts") + " of " +
           queryName + " match (" + formatPercent(matchedVolume) + " of its volume)\n" +
           pairsText(explanation) + motionText(explanation, hitName) +
           unmatchedText(explanation, query, queryName, hitName) + termsText(explanation);
}

}  // namespace shapedb::cli
