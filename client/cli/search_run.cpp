// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/search_run.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/fit_output.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "core/base/return_if_error.h"
#include "core/geometry/motion.h"

namespace shapedb::cli {

client::SearchOptions SearchFlags::resolve() const {
    client::SearchOptions resolved = options;
    resolved.reflection = !score.noReflection;
    resolved.keepScale = score.keepScale;
    resolved.freeScale = score.freeScale;
    resolved.partial = score.partial;
    resolved.verify = verify.verify;
    resolved.verifyCandidates = verify.candidates;
    resolved.atLeast = cluster.atLeast;
    resolved.allowPartial = cluster.allowPartial;
    const VerifyOptions verifyOptions = verify.options();
    resolved.oneSided = verifyOptions.oneSided;
    resolved.viewpoint = verifyOptions.viewpoint;
    return resolved;
}

void addSearchFlags(CLI::App& command, SearchFlags& flags) {
    command.add_flag("--include-self", flags.includeSelf, "With --key: keep the shape itself among the hits");
    addCollectionOption(command, flags.options.collection);
    command.add_option("-k,--k", flags.options.k, "Most hits to return")->capture_default_str();
    command.add_option("--threshold", flags.options.threshold, "Lowest score of a hit, 0 to 1");
    command.add_option("--filter", flags.options.filter, "Only shapes with such metadata, e.g. 'label=cup'");
    addScoreFlags(command, flags.score);
    addFreeScaleFlag(command, flags.score);
    addUnitFlag(command, flags.unit);
    addVerifyFlags(command, flags.verify);
    addClusterFlags(command, flags.cluster);
    addScanFlags(command, flags.scan);
    addFormatFlag(command, flags.scan);
}

Result<Answer> Searcher::withFile(const std::string& path, const RunContext& context) const {
    auto scan = loadScan(path, flags.scan, flags.scan.seed, context, true);
    if (!scan) return fail(withKeyHint(scan.error(), path));
    Answer answer;
    answer.query = path;
    answer.points = scan->points;
    answer.scene = std::move(scan->scene);
    answer.pointsInScene = scan->pointsInScene;
    client::SearchOptions options = flags.resolve();
    if (factor != 1.0) {
        scaleBy(factor, scan->points);
        if (options.viewpoint) options.viewpoint = factor * *options.viewpoint;
    }
    auto reply = client.searchByScan(options, scan->points, context);
    if (!reply) return fail(withContext(reply.error(), scanName(path) + ": "));
    answer.reply = std::move(*reply);
    finish(answer);
    return answer;
}

Result<Answer> Searcher::withKey(const std::string& key, const RunContext& context) const {
    auto reply = client.searchByKey(flags.resolve(), key, flags.includeSelf, context);
    RETURN_IF_ERROR(reply);
    Answer answer;
    answer.query = key;
    answer.stored = true;
    answer.reply = std::move(*reply);
    finish(answer);
    return answer;
}

void Searcher::finish(Answer& answer) const {
    if (factor != 1.0) scaleBy(1.0 / factor, answer.reply);
    const LengthUnit unit = unitOfAnswer(flags.unit, answer.reply.unit);
    if (unit != LengthUnit::kNone) answer.unit = lengthUnitName(unit);
}

Result<PointCloud> Searcher::pointsOf(const Answer& answer, const RunContext& context) const {
    if (!answer.stored) return answer.points;
    auto stored = client.getPoints({flags.options.collection, answer.query}, context);
    RETURN_IF_ERROR(stored);
    if (factor != 1.0) scaleBy(1.0 / factor, stored->points);
    return std::move(stored->points);
}

Result<PointCloud> Searcher::pointsOf(const client::Hit& hit, const RunContext& context) const {
    const auto motion = motionOf(hit);
    if (!motion) {
        return fail(ErrorCode::kNotReady, hit.shape.key +
                                              ": how it lies on the query is not known: leave out "
                                              "--no-explanation, or add --verify");
    }
    auto stored = client.getPoints({hit.shape.collection, hit.shape.key}, context);
    RETURN_IF_ERROR(stored);
    if (factor != 1.0) scaleBy(1.0 / factor, stored->points);
    return applyToCloud(*motion, stored->points);
}

std::optional<Motion> motionOf(const client::Hit& hit) {
    if (hit.fit) return hit.fit->best.motion;
    if (hit.explanation) return hit.explanation->motion;
    return std::nullopt;
}

using nlohmann::json;

namespace {

/// The group of each hit; nothing without groups.
std::vector<const client::HitGroup*> groupOfHits(const client::SearchReply& reply) {
    std::vector<const client::HitGroup*> groups;
    for (const client::HitGroup& group : reply.groups) groups.insert(groups.end(), group.hits, &group);
    groups.resize(reply.groups.empty() ? 0 : reply.hits.size(), nullptr);
    return groups;
}

json valueOf(const client::HitGroup* group) {
    return group != nullptr && group->value ? json(*group->value) : json();
}

json replyJson(const client::SearchReply& reply) {
    json hits = json::array();
    const auto groups = groupOfHits(reply);
    for (std::size_t i = 0; i < reply.hits.size(); ++i) {
        const client::Hit& hit = reply.hits[i];
        json entry = {{"rank", i + 1},
                      {"key", hit.shape.key},
                      {"label", labelOf(hit.shape)},
                      {"score", hit.score},
                      {"signature_score", hit.signatureScore},
                      {"verified", hit.fit.has_value()},
                      {"verdict", verdictJson(hit.verdict)},
                      {"verdict_reliability", hit.verdictReliability},
                      {"mirrored", mirroredJson(fitsMirrored(hit.fit))},
                      {"shape", toJson(hit.shape)}};
        if (const auto motion = motionOf(hit)) entry["matrix"] = matrixOf(*motion);
        if (!groups.empty()) entry["group"] = valueOf(groups[i]);
        if (hit.fit) entry["fit"] = toJson(*hit.fit);
        if (hit.explanation) entry["explanation"] = toJson(*hit.explanation);
        hits.push_back(std::move(entry));
    }
    json document = {{"hits", hits},
                     {"candidates", reply.candidates},
                     {"filtered", reply.filtered},
                     {"scored", reply.scored},
                     {"candidates_verified", reply.verified},
                     {"exact", reply.exact},
                     {"pending", reply.pending},
                     {"left_right_untold", reply.leftRightUntold},
                     {"covered", reply.covered},
                     {"query", toJson(reply.query)},
                     {"seconds_segment", reply.secondsSegment},
                     {"seconds_search", reply.secondsSearch}};
    if (reply.report) document["report"] = toJson(*reply.report);
    return document;
}

std::string replyText(const SearchFlags& flags, const Answer& answer, Explained explained) {
    const client::SearchReply& reply = answer.reply;
    const std::string queryName = answer.stored ? inLine(answer.query) : "the query";
    std::string text;
    if (reply.report) {
        text += inLine(scanName(answer.query)) + ": " + formatCount(reply.report->points, "point", "points") +
                ", " + formatCount(reply.report->segments, "part", "parts") + ", segmented in " +
                formatSeconds(reply.secondsSegment) + "\n";
        if (reply.report->quality < 1.0) text += interiorText(*reply.report, reply.query.scale);
    }
    text += formatCount(reply.candidates, "shape", "shapes") + " searched";
    if (reply.filtered != reply.candidates) text += ", " + formatCount(reply.filtered) + " pass the filter";
    text += ", " + formatCount(reply.scored) + " scored in full";
    if (reply.verified > 0) text += ", " + formatCount(reply.verified) + " laid on the query";
    text += ", in " + formatSeconds(reply.secondsSearch) + "\n";
    if (reply.covered < 1.0) text += coveredText(reply.covered);
    if (!reply.exact) text += "others might fit as well: --candidates lays more on the query\n";
    if (reply.leftRightUntold) text += kLeftRightUntold;
    if (reply.pending > 0) {
        text += formatCount(reply.pending, "shape has", "shapes have") +
                " no signature yet and could not be searched\n";
    }
    text += "\n";
    if (reply.hits.empty()) return text + "Nothing found.\n";

    const auto right = Table::Align::kRight;
    const auto groups = groupOfHits(reply);
    std::vector<Table::Column> columns = {{"rank", right}, {"score", right}, {""},
                                          {"verdict"},     {"label"},        {"key"}};
    if (!groups.empty()) columns.insert(columns.begin(), {flags.options.groupBy});
    Table table(std::move(columns));
    for (std::size_t i = 0; i < reply.hits.size(); ++i) {
        const client::Hit& hit = reply.hits[i];
        std::vector<std::string> cells = {
            std::to_string(i + 1), formatFixed(hit.score, 3),
            bar(hit.score, 20),    likenessText(hit.verdict, fitsMirrored(hit.fit)),
            labelOf(hit.shape),    hit.shape.key};
        if (!groups.empty()) {
            const json value = valueOf(groups[i]);
            const bool first = i == 0 || groups[i] != groups[i - 1];
            cells.insert(cells.begin(), !first ? "" : value.is_null() ? "(none)" : value.get<std::string>());
        }
        table.add(std::move(cells));
    }
    text += table.render();
    const std::size_t told = explained == Explained::kAll     ? reply.hits.size()
                             : explained == Explained::kFirst ? 1
                                                              : 0;
    for (std::size_t i = 0; i < told; ++i) {
        const client::Hit& hit = reply.hits[i];
        if (!hit.explanation) continue;
        const std::string key = inLine(hit.shape.key);
        text += "\nWhy " + key + ": " + explanationText(*hit.explanation, reply.query, queryName, key);
        if (hit.fit) text += fitText(*hit.fit, queryName, key);
    }
    return text;
}

}  // namespace

json answerJson(const SearchFlags& flags, const Answer& answer) {
    json document = replyJson(answer.reply);
    document["unit"] = answer.unit.empty() ? json() : json(answer.unit);
    if (answer.scene) document["scene"] = sceneJson(*answer.scene, answer.pointsInScene, flags.scan.isolate);
    return document;
}

std::string answerText(const SearchFlags& flags, const Answer& answer, Explained explained) {
    const std::string scene =
        answer.scene ? sceneText(*answer.scene, answer.pointsInScene, flags.scan.isolate) : std::string();
    return scene + replyText(flags, answer, explained);
}

std::string hitsCsvHeader() {
    return "query,rank,key,label,score,signature_score,verdict,mirrored,residual,explained_query,"
           "explained_other,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n";
}

std::string hitsCsv(const Answer& answer) {
    std::string text;
    for (std::size_t i = 0; i < answer.reply.hits.size(); ++i) {
        const client::Hit& hit = answer.reply.hits[i];
        CsvRow row;
        row.add(answer.query).add(std::to_string(i + 1)).add(hit.shape.key).add(labelOf(hit.shape));
        row.add(hit.score).add(hit.signatureScore);
        row.add(verdictCell(hit.verdict));
        const auto motion = motionOf(hit);
        row.add(mirroredCell(fitsMirrored(hit.fit)));
        if (hit.fit) {
            row.add(hit.fit->best.residual)
                .add(hit.fit->best.explainedQuery)
                .add(hit.fit->best.explainedOther);
        } else {
            row.add("").add("").add("");
        }
        for (std::size_t m = 0; m < 12; ++m) {
            if (motion) {
                row.add(matrixOf(*motion)[m]);
            } else {
                row.add("");
            }
        }
        text += row.line();
    }
    return text;
}

}  // namespace shapedb::cli
