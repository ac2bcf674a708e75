// `shapedb query`: the stored shapes most like a scan, or like a stored shape.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/fit_output.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct QueryFlags {
    std::string path;
    std::string key;
    client::SearchOptions options;
    ScoreFlags score;
    VerifyFlags verify;
    ScanFlags scan;
    std::optional<LengthUnit> unit;
    bool includeSelf = false;
    bool explain = false;
    bool noExplanation = false;
};

/// From coordinates of the hit to those of the query.
std::optional<Motion> motionOf(const client::Hit& hit) {
    if (hit.fit) return hit.fit->best.motion;
    if (hit.explanation) return hit.explanation->motion;
    return std::nullopt;
}

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

std::string replyText(const QueryFlags& flags, const client::SearchReply& reply) {
    const std::string queryName = flags.path.empty() ? flags.key : "the query";
    std::string text;
    if (reply.report) {
        text += flags.path + ": " + formatCount(reply.report->points, "point", "points") + ", " +
                formatCount(reply.report->segments, "part", "parts") + ", segmented in " +
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
        std::vector<std::string> cells = {std::to_string(i + 1), formatFixed(hit.score, 3),
                                          bar(hit.score, 20),    verdictText(hit.verdict),
                                          labelOf(hit.shape),    hit.shape.key};
        if (!groups.empty()) {
            const json value = valueOf(groups[i]);
            const bool first = i == 0 || groups[i] != groups[i - 1];
            cells.insert(cells.begin(), !first ? "" : value.is_null() ? "(none)" : value.get<std::string>());
        }
        table.add(std::move(cells));
    }
    text += table.render();
    const std::size_t explained = flags.explain ? reply.hits.size() : 1;
    for (std::size_t i = 0; i < explained; ++i) {
        const client::Hit& hit = reply.hits[i];
        if (!hit.explanation) continue;
        text += "\nWhy " + hit.shape.key + ": " +
                explanationText(*hit.explanation, reply.query, queryName, hit.shape.key);
        if (hit.fit) text += fitText(*hit.fit, queryName, hit.shape.key);
    }
    return text;
}

CommandResult runQuery(Session& session, const QueryFlags& flags) {
    if (flags.path.empty() == flags.key.empty()) {
        return fail(ErrorCode::kInvalidArgument, flags.key.empty()
                                                     ? "give a scan file, or --key with a stored shape"
                                                     : "give either a scan file or --key, not both");
    }
    client::SearchOptions options = flags.options;
    options.reflection = !flags.score.noReflection;
    options.keepScale = flags.score.keepScale;
    options.freeScale = flags.score.freeScale;
    options.partial = flags.score.partial;
    options.verify = flags.verify.verify;
    options.verifyCandidates = flags.verify.candidates;
    const VerifyOptions verify = flags.verify.options();
    options.oneSided = verify.oneSided;
    options.viewpoint = verify.viewpoint;
    options.explanation = !flags.noExplanation;
    const RunContext context = session.context();
    LoadedScan scan;
    if (!flags.path.empty()) {
        auto loaded = loadScan(flags.path, flags.scan, flags.scan.seed, context, true);
        RETURN_IF_ERROR(loaded);
        scan = std::move(*loaded);
    }
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto factor = factorToCollection(*client, options.collection, flags.unit, context);
    RETURN_IF_ERROR(factor);
    if (*factor != 1.0) {
        scaleBy(*factor, scan.points);
        if (options.viewpoint) options.viewpoint = *factor * *options.viewpoint;
    }
    auto reply = flags.path.empty() ? client->searchByKey(options, flags.key, flags.includeSelf, context)
                                    : client->searchByScan(options, scan.points, context);
    if (!reply) {
        if (flags.path.empty()) return fail(reply.error());
        return fail(reply.error().code, scanName(flags.path) + ": " + reply.error().message);
    }
    if (*factor != 1.0) scaleBy(1.0 / *factor, *reply);
    json document = replyJson(*reply);
    document["unit"] = unitJson(unitOfAnswer(flags.unit, reply->unit));
    std::string text = replyText(flags, *reply);
    if (scan.scene) {
        document["scene"] = sceneJson(*scan.scene, scan.pointsInScene, flags.scan.isolate);
        text = sceneText(*scan.scene, scan.pointsInScene, flags.scan.isolate) + text;
    }
    session.console().document(document);
    session.console().text(text);
    return kOk;
}

}  // namespace

void addQueryCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<QueryFlags>();
    CLI::App* command =
        app.add_subcommand("query", "Find the stored shapes most like a scan, or like a stored shape");
    command->add_option("PATH", flags->path,
                        "Scan to search with, or - for standard input; it is not stored");
    command->add_option("--key", flags->key, "Search with this stored shape instead");
    command->add_flag("--include-self", flags->includeSelf,
                      "With --key: keep the shape itself among the hits");
    addCollectionOption(*command, flags->options.collection);
    command->add_option("-k,--k", flags->options.k, "Most hits to return")->capture_default_str();
    command->add_option("--threshold", flags->options.threshold, "Lowest score of a hit, 0 to 1");
    command->add_option("--filter", flags->options.filter,
                        "Only shapes with such metadata, e.g. 'label=cup'");
    auto* groupBy = command->add_option("--group-by", flags->options.groupBy,
                                        "Show the best of each value of this metadata; -k counts the values");
    groupBy->type_name("NAME");
    command->add_option("--per-group", flags->options.perGroup, "Most hits of each value [1]")
        ->check(CLI::Range(1, 100))
        ->needs(groupBy);
    addScoreFlags(*command, flags->score);
    addFreeScaleFlag(*command, flags->score);
    addUnitFlag(*command, flags->unit);
    addVerifyFlags(*command, flags->verify);
    auto* none = command->add_flag("--no-explanation", flags->noExplanation, "Do not explain the hits");
    command->add_flag("--explain", flags->explain, "Explain every hit, not only the first")->excludes(none);
    addScanFlags(*command, flags->scan);
    addFormatFlag(*command, flags->scan);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runQuery(session, *flags); }; });
}

}  // namespace shapedb::cli
