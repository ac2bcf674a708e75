// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb duplicates`: the pairs of a collection that are nearly the same.
#include <algorithm>
#include <map>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/duplicate_search.h"
#include "client/cli/fit_output.h"
#include "client/cli/parameters.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "client/io/output_file.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct DuplicatesFlags {
    DuplicateOptions options;
    ScoreFlags score;
    bool csv = false;
    bool noVerify = false;
    std::string out;
};

/// The group of each shape that is in one.
std::map<std::size_t, std::size_t> groupNumbers(const DuplicateReport& report) {
    std::map<std::size_t, std::size_t> numbers;
    for (std::size_t g = 0; g < report.groups.size(); ++g) {
        for (const std::size_t shape : report.groups[g]) numbers[shape] = g;
    }
    return numbers;
}

/// Known of pairs that were laid on each other.
std::optional<bool> mirroredOf(const DuplicatePair& pair) {
    return pair.fit ? pair.fit->mirrored : std::nullopt;
}

json pairJson(const DuplicateReport& report, const DuplicatePair& pair, std::size_t group) {
    json entry = {{"group", group + 1},
                  {"a", report.shapes[pair.a].key},
                  {"b", report.shapes[pair.b].key},
                  {"score", pair.score()},
                  {"signature_score", pair.signatureScore},
                  {"verdict", verdictJson(pair.fit ? pair.fit->verdict : Verdict::kNone)},
                  {"mirrored", mirroredJson(mirroredOf(pair))},
                  {"residual", nullptr}};
    if (pair.fit && pair.fit->pose) {
        entry["residual"] = pair.fit->pose->residual;
        entry["matrix"] = matrixOf(pair.fit->pose->motion);
    }
    return entry;
}

std::string duplicatesCsv(const DuplicateReport& report) {
    const auto groups = groupNumbers(report);
    std::string text = "group,a,b,score,signature_score,verdict,mirrored,residual\n";
    for (const DuplicatePair& pair : report.pairs) {
        CsvRow row;
        row.add(std::to_string(groups.at(pair.a) + 1));
        row.add(report.shapes[pair.a].key).add(report.shapes[pair.b].key);
        row.add(pair.score()).add(pair.signatureScore);
        const bool laid = pair.fit && pair.fit->pose;
        row.add(pair.fit ? verdictCell(pair.fit->verdict) : "");
        row.add(mirroredCell(mirroredOf(pair)));
        row.add(laid ? exactNumber(pair.fit->pose->residual) : std::string());
        text += row.line();
    }
    return text;
}

/// A line of the table: a shape, and what it is to one listed before.
std::vector<std::string> cellsOf(const DuplicateReport& report, std::size_t group, const DuplicateLink& link,
                                 bool verified) {
    const client::Shape& one = report.shapes[link.shape];
    if (link.pair == nullptr) return {std::to_string(group + 1), one.key, labelOf(one)};
    const DuplicatePair& pair = *link.pair;
    std::vector<std::string> cells = {"", one.key, labelOf(one), formatFixed(pair.signatureScore, 3)};
    if (verified) cells.push_back(formatFixed(pair.score(), 3));
    cells.push_back(report.shapes[pair.a == link.shape ? pair.b : pair.a].key);
    // a was the query, but there is none here.
    if (verified && pair.fit) {
        cells.push_back(likenessText(pair.fit->verdict, pair.fit->mirrored,
                                     pair.a == link.shape ? "part of it" : "contains it"));
    }
    return cells;
}

/// Of pairs by score: a better verdict counts more, and the twin itself more than its mirror image.
bool tellsMore(const DuplicatePair* one, const DuplicatePair* other) {
    const auto rank = [](const DuplicatePair& pair) {
        return std::pair(pair.fit ? pair.fit->verdict : Verdict::kNone, mirroredOf(pair).value_or(false));
    };
    return rank(*one) < rank(*other);
}

std::string duplicatesText(const DuplicatesFlags& flags, const DuplicateReport& report) {
    std::size_t members = 0;
    for (const auto& group : report.groups) members += group.size();
    const std::string scored = "signatures score " + formatNumber(flags.options.threshold) + " or more";
    const std::string covered = report.covered < 1.0 ? coveredText(report.covered) : std::string();
    if (report.pairs.empty()) {
        return covered + "no near-duplicates among " + formatCount(report.shapes.size(), "shape", "shapes") +
               " (no two " + scored + ")\n";
    }
    std::string text =
        covered + formatCount(members) + " of " + formatCount(report.shapes.size(), "shape", "shapes") +
        " have near-duplicates: " + formatCount(report.pairs.size(), "pair", "pairs") + " in " +
        formatCount(report.groups.size(), "group", "groups") + " (" + scored + ")\n\n";
    const auto numbers = groupNumbers(report);
    std::map<std::size_t, std::vector<const DuplicatePair*>> pairsOf;  // by group
    for (const DuplicatePair& pair : report.pairs) pairsOf[numbers.at(pair.a)].push_back(&pair);
    for (auto& [group, pairs] : pairsOf) std::stable_sort(pairs.begin(), pairs.end(), tellsMore);
    const auto right = Table::Align::kRight;
    std::vector<Table::Column> columns = {{"group", right}, {"key"}, {"label"}, {"signatures", right}};
    if (!flags.noVerify) columns.push_back({"score", right});
    columns.push_back({"like"});
    if (!flags.noVerify) columns.push_back({"verdict"});
    Table table(std::move(columns));
    for (std::size_t g = 0; g < report.groups.size(); ++g) {
        for (const DuplicateLink& link : linksOf(report.groups[g], pairsOf[g])) {
            table.add(cellsOf(report, g, link, !flags.noVerify));
        }
    }
    return text + table.render();
}

CommandResult runDuplicates(Session& session, const DuplicatesFlags& flags) {
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    DuplicateOptions options = flags.options;
    options.score = flags.score.forServer();
    options.compare = !flags.noVerify;
    RunContext context = session.context();
    context.progress = nullptr;  // progress counts shapes and pairs
    Console& console = session.console();
    const auto report = findDuplicates(
        *client, options,
        [&](const char* what, std::uint64_t done, std::uint64_t total) {
            console.progress(what, done, total);
        },
        context);
    RETURN_IF_ERROR(report);
    if (!flags.out.empty()) RETURN_IF_ERROR(writeTextFile(flags.out, duplicatesCsv(*report)));
    const auto numbers = groupNumbers(*report);
    json pairs = json::array();
    for (const DuplicatePair& pair : report->pairs) {
        if (!console.json()) break;
        json entry = pairJson(*report, pair, numbers.at(pair.a));
        console.item(entry);
        if (!console.lines()) pairs.push_back(std::move(entry));
    }
    json groups = json::array();
    for (const auto& group : report->groups) {
        json keys = json::array();
        for (const std::size_t shape : group) keys.push_back(report->shapes[shape].key);
        groups.push_back(std::move(keys));
    }
    if (!console.lines()) {
        console.document({{"threshold", options.threshold},
                          {"shapes", report->shapes.size()},
                          {"covered", report->covered},
                          {"pairs", pairs},
                          {"groups", groups}});
    }
    console.text(flags.csv ? duplicatesCsv(*report) : duplicatesText(flags, *report));
    if (!flags.out.empty() && !flags.csv) console.text("\nPairs: " + inLine(flags.out) + "\n");
    return kOk;
}

}  // namespace

void addDuplicatesCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<DuplicatesFlags>();
    CLI::App* command = app.add_subcommand(
        "duplicates", "Find the pairs of a collection that are nearly the same: all of them, in groups");
    auto* positional =
        command->add_option("COLLECTION", flags->options.collection, "Collection to look in [default]");
    command->add_option("--collection", flags->options.collection, "The same")
        ->type_name("NAME")
        ->excludes(positional);
    command->add_option("--threshold", flags->options.threshold, "Lowest score of the signatures of a pair")
        ->check(aboveZero())
        ->capture_default_str();
    command->add_option("--filter", flags->options.filter,
                        "Only among shapes with such metadata, e.g. 'label=cup'");
    command->add_flag("--csv", flags->csv, "Print a line of CSV for each pair");
    command->add_option("-o,--out", flags->out, "Write them to a file")
        ->type_name("FILE.csv")
        ->check(endsIn(".csv"));
    command->add_flag(
        "--no-verify", flags->noVerify,
        "Do not lay the shapes of each pair on each other, which says what they are and whether one is "
        "the mirror image of the other");
    command->add_option("--jobs", flags->options.jobs, "Pairs compared at the same time")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    command->add_flag("--no-reflection", flags->score.noReflection,
                      "Treat mirror images as different shapes");
    command->add_flag("--keep-scale", flags->score.keepScale, "Compare sizes too");
    addFreeScaleFlag(*command, flags->score);
    addClusterFlags(*command, flags->options.cluster);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runDuplicates(session, *flags); }; });
}

}  // namespace shapedb::cli
