// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/query_output.h"

#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/csv.h"
#include "client/cli/fit_output.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"

namespace shapedb::cli {

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
