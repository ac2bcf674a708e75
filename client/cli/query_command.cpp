// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb query`: the stored shapes most like scans, or like a stored shape.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/failures.h"
#include "client/cli/search_run.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "client/io/output_file.h"
#include "client/io/ply_writer.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

struct QueryFlags {
    std::vector<std::string> paths;
    std::string key;
    SearchFlags search;
    bool explain = false;
    bool noExplanation = false;
    std::string csv;      ///< -o
    std::string aligned;  ///< --out-aligned
};

/// A key or path as the name of a file: without folders.
std::string fileNameOf(std::string name) {
    std::replace(name.begin(), name.end(), '/', '_');
    return name.front() == '.' ? "_" + name : name;
}

/// --out-aligned of several queries: a folder for each, named as it is below the folder that all are in,
/// without its ending unless that tells it from another.
std::vector<fs::path> foldersOf(const std::vector<ScanFile>& files) {
    std::vector<fs::path> paths;
    for (const ScanFile& file : files) paths.push_back(fs::absolute(file.path).lexically_normal());
    fs::path common = paths.empty() ? fs::path() : paths.front().parent_path();
    const auto isBelow = [&](const fs::path& path) {
        const auto [end, _] = std::mismatch(common.begin(), common.end(), path.begin(), path.end());
        return end == common.end();
    };
    while (!std::all_of(paths.begin(), paths.end(), isBelow)) common = common.parent_path();
    std::set<fs::path> taken;
    for (std::size_t i = 0; i < paths.size(); ++i) {
        const fs::path name = paths[i].lexically_relative(common);
        const fs::path bare = withoutScanEnding(name.generic_string());
        paths[i] = files[i].sharesName || taken.count(bare) > 0 ? name : bare;
        taken.insert(paths[i]);
    }
    return paths;
}

/// --out-aligned: the query and its hits, in its coordinates. Moved ones have more digits than single
/// precision.
Result<void> writeAligned(const Searcher& searcher, const Answer& answer, const fs::path& folder,
                          const RunContext& context) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return fail(ErrorCode::kFileNotWritable, folder.string() + ": " + error.message());
    const auto query = searcher.pointsOf(answer, context);
    RETURN_IF_ERROR(query);
    RETURN_IF_ERROR(writePointsPly((folder / "query.ply").string(), *query, PlyPrecision::kDouble));
    const std::size_t digits = std::max<std::size_t>(2, std::to_string(answer.reply.hits.size()).size());
    for (std::size_t i = 0; i < answer.reply.hits.size(); ++i) {
        const client::Hit& hit = answer.reply.hits[i];
        const auto moved = searcher.pointsOf(hit, context);
        RETURN_IF_ERROR(moved);
        std::string rank = std::to_string(i + 1);
        rank.insert(0, digits - rank.size(), '0');
        const fs::path file = folder / (rank + "_" + fileNameOf(hit.shape.key) + ".ply");
        RETURN_IF_ERROR(writePointsPly(file.string(), *moved, PlyPrecision::kDouble));
    }
    return {};
}

/// One run of the command.
struct QueryRun {
    Session& session;
    const QueryFlags& flags;
    const Searcher& searcher;
    Explained explained;
    std::string csv = hitsCsvHeader();

    /// Does with an answer what all queries have in common. `folder`: of --out-aligned.
    Result<void> keep(const Answer& answer, const fs::path& folder) {
        csv += hitsCsv(answer);
        if (flags.aligned.empty()) return {};
        return writeAligned(searcher, answer, folder, session.context());
    }

    /// Writes the file of -o; returns a sentence about what was written.
    Result<std::string> finish() const {
        std::string text;
        if (!flags.csv.empty()) {
            RETURN_IF_ERROR(writeTextFile(flags.csv, csv));
            text += "Hits: " + inLine(flags.csv) + "\n";
        }
        if (!flags.aligned.empty()) text += "Aligned with the query: " + inLine(flags.aligned) + "\n";
        return text.empty() ? text : "\n" + text;
    }
};

CommandResult runOne(QueryRun& run, const std::string& path) {
    const RunContext context = run.session.context();
    const auto answer = run.flags.key.empty() ? run.searcher.withFile(path, context)
                                              : run.searcher.withKey(run.flags.key, context);
    RETURN_IF_ERROR(answer);
    RETURN_IF_ERROR(run.keep(*answer, run.flags.aligned));
    const auto written = run.finish();
    RETURN_IF_ERROR(written);
    json document = answerJson(run.flags.search, *answer);
    if (!run.flags.csv.empty()) document["out"] = run.flags.csv;
    if (!run.flags.aligned.empty()) document["out_aligned"] = run.flags.aligned;
    run.session.console().document(document);
    run.session.console().text(answerText(run.flags.search, *answer, run.explained) + *written);
    return kOk;
}

CommandResult runMany(QueryRun& run, const std::vector<ScanFile>& files) {
    Console& console = run.session.console();
    json queries = json::array();
    json failed = json::array();
    Failures failures;
    std::optional<Error> stop;
    std::size_t done = 0;
    RunContext context = run.session.context();
    context.progress = nullptr;  // progress counts files
    const std::vector<fs::path> folders = foldersOf(files);
    for (std::size_t i = 0; i < files.size(); ++i) {
        const ScanFile& file = files[i];
        console.progress("query", done, files.size());
        const auto answer = run.searcher.withFile(file.path, context);
        Result<void> kept = answer ? run.keep(*answer, fs::path(run.flags.aligned) / folders[i])
                                   : Result<void>(fail(answer.error()));
        if (!kept) {
            if (endsTheCommand(kept.error())) {
                stop = kept.error();
                break;
            }
            json entry = {{"file", file.path}, {"error", toJson(kept.error())}};
            console.item(entry);
            failed.push_back(std::move(entry));
            failures.add(file.path, kept.error());
        } else {
            json entry = answerJson(run.flags.search, *answer);
            entry["file"] = file.path;
            console.item(entry);
            if (console.json() && !console.lines()) queries.push_back(std::move(entry));
            console.text((done > 0 ? "\n" : "") + answerText(run.flags.search, *answer, run.explained));
        }
        if (console.readerLeft()) break;
        ++done;
    }
    const auto written = run.finish();
    RETURN_IF_ERROR(written);
    if (!console.lines()) {
        json document = {{"queries", queries}, {"failed", failed}};
        if (stop) document["ended_by"] = toJson(*stop);
        console.document(document);
    }
    console.text(*written);
    failures.tell(console, files.size(), "query", "queries");
    if (!stop) return failures.exitCode(files.size());
    console.note((stop->code == ErrorCode::kCancelled ? "interrupted" : stop->message) + ": " +
                 formatCount(files.size() - done) + " of " + formatCount(files.size(), "query", "queries") +
                 " not made");
    return exitCodeOf(stop->code);
}

Result<void> checkFlags(const QueryFlags& flags) {
    if (flags.paths.empty() == flags.key.empty()) {
        return fail(ErrorCode::kInvalidArgument, flags.key.empty()
                                                     ? "give a scan file, or --key with a stored shape"
                                                     : "give either a scan file or --key, not both");
    }
    const bool piped = std::count(flags.paths.begin(), flags.paths.end(), "-") > 0;
    if (piped && flags.paths.size() > 1) {
        return fail(ErrorCode::kInvalidArgument, "standard input can only be the one query");
    }
    return {};
}

CommandResult runQuery(Session& session, const QueryFlags& flags) {
    RETURN_IF_ERROR(checkFlags(flags));
    std::vector<ScanFile> files;
    const bool alone = flags.paths.size() < 2 && (flags.paths.empty() || !fs::is_directory(flags.paths[0]));
    if (!alone) {
        auto listed = listScanFiles(flags.paths, !flags.search.scan.format.empty());
        RETURN_IF_ERROR(listed);
        files = std::move(*listed);
    }
    SearchFlags search = flags.search;
    // Explanations are long; of many queries they are for those who ask.
    const bool explains = !flags.noExplanation && (alone || flags.explain || session.console().json());
    // Without one an unverified hit has no motion.
    search.options.explanation = explains || (!flags.noExplanation && !(flags.csv + flags.aligned).empty());
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto factor =
        factorToCollection(*client, search.options.collection, search.unit, session.context());
    RETURN_IF_ERROR(factor);
    const Searcher searcher{*client, search, *factor};
    const Explained explained = !explains       ? Explained::kNone
                                : flags.explain ? Explained::kAll
                                                : Explained::kFirst;
    QueryRun run{session, flags, searcher, explained};
    if (alone) return runOne(run, flags.paths.empty() ? "" : flags.paths.front());
    // Checked first, so that a wrong collection is reported once and not for every query.
    RETURN_IF_ERROR(client->getCollection(search.options.collection, session.context()));
    return runMany(run, files);
}

}  // namespace

void addQueryCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<QueryFlags>();
    CLI::App* command =
        app.add_subcommand("query", "Find the stored shapes most like scans, or like a stored shape");
    command->add_option(
        "PATH", flags->paths,
        "Scans to search with, or folders of them, or - for standard input; they are not stored");
    command->add_option("--key", flags->key, "Search with this stored shape instead")->check(notEmpty());
    addSearchFlags(*command, flags->search);
    client::SearchOptions& options = flags->search.options;
    auto* groupBy = command->add_option("--group-by", options.groupBy,
                                        "Show the best of each value of this metadata; -k counts the values");
    groupBy->type_name("NAME");
    command->add_option("--per-group", options.perGroup, "Most hits of each value [1]")
        ->check(CLI::Range(1, 100))
        ->needs(groupBy);
    auto* none = command->add_flag("--no-explanation", flags->noExplanation, "Do not explain the hits");
    command->add_flag("--explain", flags->explain, "Explain every hit, not only the first")->excludes(none);
    command->add_option("-o,--out", flags->csv, "Write a line for each hit")
        ->type_name("FILE.csv")
        ->check(endsIn(".csv"));
    command
        ->add_option(
            "--out-aligned", flags->aligned,
            "Write the query and the hits aligned to it as PLY files to this folder, those of several "
            "queries to folders below it")
        ->type_name("DIR");
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runQuery(session, *flags); }; });
}

}  // namespace shapedb::cli
