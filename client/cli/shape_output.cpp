#include "client/cli/shape_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <set>

#include <nlohmann/json.hpp>

#include "client/cli/text.h"
#include "core/base/math.h"
#include "core/signature/signature_codec.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

/// Matched pairs told one by one; the rest is counted.
constexpr std::size_t kPairsTold = 3;
/// Pairs that contribute less than this share of the similarity are not worth a reader's time.
constexpr double kShareWorthTelling = 0.01;

json pointJson(const Point3& p) { return json::array({p.x, p.y, p.z}); }

std::string timeText(client::Timestamp time) {
    const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
    std::tm parts{};
    if (gmtime_r(&seconds, &parts) == nullptr) return {};
    char buffer[40];
    const std::size_t length = std::strftime(buffer, sizeof buffer, "%Y-%m-%dT%H:%M:%SZ", &parts);
    return std::string(buffer, length);
}

/// "segment 4" or "segments 4, 5 and 7", counted from 1.
std::string segmentList(const std::vector<std::uint32_t>& indices) {
    std::string text = indices.size() == 1 ? "segment " : "segments ";
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (i > 0) text += i + 1 == indices.size() ? " and " : ", ";
        text += std::to_string(indices[i] + 1);
    }
    return text;
}

double volumeShareOf(const client::Signature& signature, std::uint32_t index) {
    return index < signature.points.size() ? signature.points[index].volumeShare : 0.0;
}

/// The heaviest pairs one by one; what adds next to nothing is only counted.
std::string pairsText(const client::Explanation& explanation) {
    std::string text;
    std::size_t told = 0;
    for (const client::SegmentMatch& match : explanation.matches) {
        if (told == kPairsTold || (told > 0 && match.share < kShareWorthTelling)) break;
        if (told > 0) text += ", ";
        text += std::to_string(match.query + 1) + " on " + std::to_string(match.hit + 1) + " (" +
                formatPercent(match.share) + " of the match, " + formatPercent(match.distance) +
                " of the size apart)";
        ++told;
    }
    const std::size_t more = explanation.matches.size() - told;
    if (more == 0) return text;
    const bool slight = explanation.matches[told].share < kShareWorthTelling;
    return text + " and " + std::to_string(more) + (slight ? " that hardly count" : " more");
}

std::string unmatchedText(const client::Explanation& explanation, const client::Signature& query,
                          const std::string& queryName, const std::string& hitName) {
    std::string text;
    if (!explanation.unmatchedQuery.empty()) {
        double volume = 0.0;
        for (const std::uint32_t index : explanation.unmatchedQuery) volume += volumeShareOf(query, index);
        text += segmentList(explanation.unmatchedQuery) + " of " + queryName + " (" + formatPercent(volume) +
                " of its volume)";
    }
    if (!explanation.unmatchedHit.empty()) {
        if (!text.empty()) text += ", ";
        text += segmentList(explanation.unmatchedHit) + " of " + hitName;
    }
    return text.empty() ? text : "Without a partner: " + text + ".\n";
}

std::string termsText(const client::Explanation& explanation) {
    std::string text;
    for (const client::ScoreTerm& term : explanation.terms) {
        text += (text.empty() ? "" : ", ") + term.name + " " + formatFixed(term.distance, 2);
    }
    return text.empty() ? text : "Differences, 1 being what unrelated shapes differ by: " + text + ".\n";
}

std::string motionText(const client::Explanation& explanation, const std::string& hitName) {
    const Motion& motion = explanation.motion;
    std::string text = "To get there " + hitName + " is ";
    if (motion.reflected) text += "mirrored and ";
    text += "turned by " + formatFixed(rotationDegrees(motion), 0) + " degrees";
    if (std::abs(motion.scale - 1.0) < 5e-4) {
        text += " at its own size";
    } else {
        text += std::string(motion.scale > 1.0 ? ", enlarged" : ", shrunk") + " to " +
                formatNumber(motion.scale) + " times its size";
    }
    return text + (motion.reflected ? ".\n" : " and not mirrored.\n");
}

client::ShapeAttributes toClient(const ShapeAttributes& attributes) {
    client::ShapeAttributes out;
    out.quality = attributes.quality / 255.0;
    for (const StatisticLayout& layout : kStatistics) {
        client::ShapeStatistic statistic{layout.name, {}, layout.evidence == Evidence::kInside};
        for (std::size_t i = layout.offset; i < std::size_t{layout.offset} + layout.count; ++i) {
            statistic.shares.push_back(static_cast<float>(shareOfLevel(attributes.statistics[i])));
        }
        out.statistics.push_back(std::move(statistic));
    }
    return out;
}

client::InteriorSource toClient(InteriorSource source) {
    switch (source) {
        case InteriorSource::kWalk: return client::InteriorSource::kWalk;
        case InteriorSource::kPotential: return client::InteriorSource::kPotential;
        case InteriorSource::kThickened: return client::InteriorSource::kThickened;
    }
    return client::InteriorSource::kWalk;
}

}  // namespace

client::Signature toClient(const Signature& signature) {
    client::Signature out;
    if (signature.attributes) out.attributes = toClient(*signature.attributes);
    out.scale = signature.scale;
    out.volume = signature.volume;
    out.encoded = encodeSignature(signature);
    for (std::size_t i = 0; i < signature.points.size(); ++i) {
        client::WeightedPoint point;
        point.position = pointPosition(signature, i);
        point.weight = pointVolume(signature, i);
        point.volumeShare = signature.points[i].volumeShare;
        point.maximumRadius = static_cast<double>(signature.points[i].maximumRadius) * signature.scale;
        point.extents = pointExtents(signature, i);
        out.points.push_back(point);
    }
    return out;
}

client::Explanation toClient(const Explanation& explanation) {
    client::Explanation out;
    out.similarity = explanation.similarity;
    out.dissimilarity = explanation.dissimilarity;
    out.motion = explanation.motion;
    for (const PointMatch& match : explanation.matches) {
        out.matches.push_back({match.a, match.b, match.share, match.distance});
    }
    out.unmatchedQuery = explanation.unmatchedA;
    out.unmatchedHit = explanation.unmatchedB;
    out.degenerate = explanation.degenerate;
    for (const ScoreTerm& term : explanation.terms) {
        out.terms.push_back({term.name, term.distance, term.weight});
    }
    return out;
}

client::SegmentationReport reportOf(const Segmentation& segmentation) {
    client::SegmentationReport report;
    report.points = segmentation.pointSegment.size();
    report.pointsUsed = segmentation.sites.size();
    report.duplicates = segmentation.duplicates;
    report.outliers = segmentation.outliers;
    report.quality = segmentation.quality;
    report.interiorSource = toClient(segmentation.interiorSource);
    report.angleDegrees = segmentation.angleDegrees;
    report.noise = segmentation.noise;
    report.tetrahedra = segmentation.tetrahedra.size();
    report.interiorTetrahedra = segmentation.interiorTetrahedra;
    report.maxima = segmentation.maxima;
    report.segments = segmentation.segments.size();
    report.volume = segmentation.volume;
    report.delaunaySeconds = segmentation.delaunaySeconds;
    report.totalSeconds = segmentation.totalSeconds;
    for (const shapedb::StageTime& stage : segmentation.stages) {
        report.stages.push_back({stage.stage, stage.seconds});
    }
    return report;
}

std::string hexText(const std::string& bytes) {
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    for (const char c : bytes) {
        text += kDigits[static_cast<unsigned char>(c) >> 4];
        text += kDigits[static_cast<unsigned char>(c) & 15];
    }
    return text;
}

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
            {"quality", report.quality},
            {"interior_source", client::sourceName(report.interiorSource)},
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
    if (report.outliers > 0)
        steps.push_back("leaving out " + formatCount(report.outliers, "outlier", "outliers"));
    if (report.duplicates > 0) {
        steps.push_back("merging " + formatCount(report.duplicates, "duplicate", "duplicates"));
    }
    if (report.pointsUsed + report.duplicates + report.outliers < report.points) {
        steps.emplace_back("averaging and thinning");
    }
    std::string text = formatCount(report.pointsUsed) + " after ";
    for (std::size_t i = 0; i < steps.size(); ++i) {
        if (i > 0) text += i + 1 == steps.size() ? " and " : ", ";
        text += steps[i];
    }
    return text + "\n";
}

std::string qualityText(double quality) {
    std::string text = "interior quality " + formatFixed(quality, 2) + " of 1";
    if (quality < kQualityWorthWarning) {
        text +=
            ": open, thin or noisy, so volumes and segments are a guess; more sides or less noise would help";
    }
    return text + "\n";
}

std::string interiorText(const client::SegmentationReport& report) {
    std::string text = "interior: ";
    switch (report.interiorSource) {
        case client::InteriorSource::kWalk:
            text += "what a walk from outside leaves at " + formatNumber(report.angleDegrees) + " degrees";
            break;
        case client::InteriorSource::kPotential: text += "what the potential puts inside"; break;
        case client::InteriorSource::kThickened: text += "the neighbourhood of the points"; break;
    }
    if (report.noise > 0.0) text += "; noise " + formatNumber(report.noise);
    return text + "\n" + qualityText(report.quality);
}

json toJson(const client::Explanation& explanation) {
    json matches = json::array();
    for (const client::SegmentMatch& match : explanation.matches) {
        matches.push_back({{"query", match.query},
                           {"hit", match.hit},
                           {"share", match.share},
                           {"distance", match.distance}});
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
                {"sha256", hexText(shape.sha256)},
                {"metadata", shape.metadata},
                {"created", timeText(shape.created)},
                {"updated", timeText(shape.updated)}};
    if (shape.failure) {
        out["failure"] = {{"name", errorCodeName(shape.failure->code)}, {"message", shape.failure->message}};
    }
    if (shape.quality) out["quality"] = *shape.quality;
    return out;
}

std::string signatureTable(const client::Signature& signature) {
    Table table({{"segment", Table::Align::kRight},
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
    Table table({{"statistic"}, {"how it is spread"}});
    for (const client::ShapeStatistic& statistic : signature.attributes->statistics) {
        const auto largest = std::max_element(statistic.shares.begin(), statistic.shares.end());
        std::string spread;
        for (const float share : statistic.shares) {
            // Roots, as the score compares them: a rare bin is still seen.
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
        return "No segment of " + queryName + " lies on one of " + hitName + ".\n" + termsText(explanation);
    }
    std::set<std::uint32_t> matched;
    for (const auto& match : explanation.matches) matched.insert(match.query);
    double matchedVolume = 0.0;
    for (const std::uint32_t index : matched) matchedVolume += volumeShareOf(query, index);
    const std::size_t count = matched.size();
    std::string text = formatCount(count) + " of " + formatCount(query.points.size(), "segment", "segments") +
                       " of " + queryName + ", " + formatPercent(matchedVolume) + " of its volume, " +
                       (count == 1 ? "lies" : "lie") + " on segments of " + hitName + ": " +
                       pairsText(explanation) + ".\n";
    text += explanation.degenerate
                ? "One of the two is a single segment, so nothing fixes how it is turned.\n"
                : motionText(explanation, hitName);
    return text + unmatchedText(explanation, query, queryName, hitName) + termsText(explanation);
}

}  // namespace shapedb::cli
