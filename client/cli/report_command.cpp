// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb report`: a search as one page that can be sent around.
#include <ctime>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/fit_output.h"
#include "client/cli/report_page.h"
#include "client/cli/search_run.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "client/io/output_file.h"
#include "core/base/return_if_error.h"
#include "core/matching/score.h"

namespace shapedb::cli {

namespace {

struct ReportFlags {
    std::string path;
    std::string key;
    std::string out;
    std::string title;
    SearchFlags search;
};

/// The reasons of a hit: full where the two agree.
std::vector<ReportBar> barsOf(const client::Hit& hit) {
    std::vector<ReportBar> bars;
    if (hit.fit) {
        const client::FitPose& best = hit.fit->best;
        bars.push_back(
            {"of the query that lies on it", best.explainedQuery, formatPercent(best.explainedQuery)});
        bars.push_back(
            {"of what should be there that is", best.explainedOther, formatPercent(best.explainedOther)});
    }
    if (!hit.explanation) return bars;
    for (const client::ScoreTerm& term : hit.explanation->terms) {
        bars.push_back({term.name, scoreOfDistance(term.distance), formatFixed(term.distance, 2)});
    }
    return bars;
}

ReportHit reportHit(const Answer& answer, const client::Hit& hit, const std::string& queryName,
                    PointCloud points) {
    ReportHit shown;
    shown.key = hit.shape.key;
    shown.label = labelOf(hit.shape);
    shown.score = hit.score;
    shown.verdict = likenessText(hit.verdict, fitsMirrored(hit.fit));
    if (hit.verdict != Verdict::kNone) {
        shown.verdict += " (right in " + formatPercent(hit.verdictReliability) + " of such cases)";
    }
    if (hit.explanation) {
        client::Explanation words = *hit.explanation;
        words.terms.clear();  // they are bars
        shown.why = explanationText(words, answer.reply.query, queryName, hit.shape.key);
    }
    if (hit.fit) shown.why += fitText(*hit.fit, queryName, hit.shape.key);
    shown.bars = barsOf(hit);
    shown.points = std::move(points);
    return shown;
}

std::string aboutText(const ReportFlags& flags, const Answer& answer) {
    const std::string collection =
        flags.search.options.collection.empty() ? "default" : flags.search.options.collection;
    std::string text =
        formatCount(answer.reply.filtered, "shape", "shapes") + " of collection " + collection + " searched";
    if (!flags.search.options.filter.empty()) text += ", with " + flags.search.options.filter;
    if (answer.reply.covered < 1.0) {
        text += ", which is " + formatPercent(answer.reply.covered) + " of the collection";
    }
    return text + ", " + timeText(client::currentTime());
}

Result<ReportPage> makePage(Session& session, const ReportFlags& flags, const Searcher& searcher,
                            const Answer& answer) {
    RunContext context = session.context();
    context.progress = nullptr;
    ReportPage page;
    page.queryName = answer.stored ? answer.query : std::filesystem::path(answer.query).filename().string();
    if (answer.query == "-") page.queryName = scanName(answer.query);
    page.title = flags.title.empty() ? "Shapes like " + page.queryName : flags.title;
    page.about = aboutText(flags, answer);
    auto query = searcher.pointsOf(answer, context);
    RETURN_IF_ERROR(query);
    page.query = std::move(*query);
    for (const client::Hit& hit : answer.reply.hits) {
        PointCloud points;
        if (motionOf(hit)) {
            auto moved = searcher.pointsOf(hit, context);
            RETURN_IF_ERROR(moved);
            points = std::move(*moved);
        }
        page.hits.push_back(reportHit(answer, hit, page.queryName, std::move(points)));
        session.console().progress("fetch", page.hits.size(), answer.reply.hits.size());
    }
    return page;
}

CommandResult runReport(Session& session, const ReportFlags& flags) {
    if (flags.path.empty() == flags.key.empty()) {
        return fail(ErrorCode::kInvalidArgument, "give a scan file, or --key with a stored shape" +
                                                     std::string(flags.key.empty() ? "" : ", not both"));
    }
    const RunContext context = session.context();
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto factor =
        factorToCollection(*client, flags.search.options.collection, flags.search.unit, context);
    RETURN_IF_ERROR(factor);
    const Searcher searcher{*client, flags.search, *factor};
    const auto answer =
        flags.key.empty() ? searcher.withFile(flags.path, context) : searcher.withKey(flags.key, context);
    RETURN_IF_ERROR(answer);
    const auto page = makePage(session, flags, searcher, *answer);
    RETURN_IF_ERROR(page);
    const std::string html = reportHtml(*page);
    RETURN_IF_ERROR(writeTextFile(flags.out, html));
    nlohmann::json document = answerJson(flags.search, *answer);
    document["out"] = flags.out;
    session.console().document(document);
    session.console().text(formatCount(page->hits.size(), "hit", "hits") + " in " + inLine(flags.out) + " (" +
                           formatBytes(html.size()) + "): open it with a browser\n");
    if (answer->reply.covered < 1.0) session.console().text(coveredText(answer->reply.covered));
    return kOk;
}

}  // namespace

void addReportCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<ReportFlags>();
    CLI::App* command = app.add_subcommand(
        "report",
        "Write a search as one HTML page: the query, the hits aligned to it in 3D, and the reasons");
    command->add_option("QUERY", flags->path,
                        "Scan to search with, or - for standard input; it is not stored");
    command->add_option("--key", flags->key, "Search with this stored shape instead")->check(notEmpty());
    command->add_option("-o,--out", flags->out, "File to write")
        ->type_name("FILE.html")
        ->required()
        ->check(endsIn(".html"));
    command->add_option("--title", flags->title, "Heading of the page [Shapes like QUERY]")
        ->type_name("TEXT");
    addSearchFlags(*command, flags->search);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runReport(session, *flags); }; });
}

}  // namespace shapedb::cli
