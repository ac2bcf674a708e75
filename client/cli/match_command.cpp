// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb match`: of two folders, which scan of one belongs to which of the other.
#include <algorithm>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "client/cli/failures.h"
#include "client/cli/fit_output.h"
#include "client/cli/parameters.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "client/io/output_file.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct MatchFlags {
    std::string a;
    std::string b;
    std::string out;
    bool csv = false;
    double threshold = 0.0;
    unsigned threads = defaultThreads();
    ScoreFlags score;
    VerifyFlags verify;
    ScanFlags scan;
    ParameterFlags parameters;
    std::optional<LengthUnit> unit;
};

/// What a scan of the first folder belongs to.
struct Partner {
    std::size_t a = 0;
    std::optional<std::size_t> b;  ///< not set: none scores the threshold
    double score = 0.0;
    double nextScore = 0.0;  ///< of the second best
    /// No other scan of the first folder scores better with it.
    bool mutual = false;
    Verdict verdict = Verdict::kNone;
    std::optional<FitResult> fit;
};

struct Matched {
    std::vector<EvaluatedShape> a;
    std::vector<EvaluatedShape> b;
    std::vector<Partner> partners;  ///< of the usable ones of `a`, in their order
};

Result<std::vector<EvaluatedShape>> describeFolder(Session& session, const MatchFlags& flags,
                                                   const ShapeParameters& parameters,
                                                   const std::string& folder) {
    const auto scans = listCollection({folder});
    RETURN_IF_ERROR(scans);
    std::vector<EvaluatedShape> shapes = shapesOf(*scans);
    RETURN_IF_ERROR(describeShapes(
        shapes, flags.scan, parameters, true, flags.threads,
        [&](std::size_t done) { session.console().progress("segment " + folder, done, shapes.size()); },
        session.context()));
    return shapes;
}

/// The best and second best columns of row `a`, and whether row `a` is the best of that column.
Partner bestOf(const ScoreMatrix& scores, const Matched& matched, std::size_t a, double threshold) {
    const std::size_t columns = matched.b.size();
    Partner partner;
    partner.a = a;
    for (std::size_t b = 0; b < columns; ++b) {
        const double score = scores[a * columns + b];
        if (!matched.b[b].signature) continue;
        if (!partner.b || score > partner.score) {
            partner.nextScore = partner.b ? partner.score : 0.0;
            partner.b = b;
            partner.score = score;
        } else {
            partner.nextScore = std::max(partner.nextScore, score);
        }
    }
    if (partner.b && partner.score < threshold) partner.b.reset();
    partner.mutual = partner.b.has_value();
    for (std::size_t other = 0; partner.b && other < matched.a.size(); ++other) {
        if (other != a && scores[other * columns + *partner.b] > partner.score) partner.mutual = false;
    }
    return partner;
}

Result<Matched> matchFolders(Session& session, const MatchFlags& flags) {
    const auto sizesCount = sizesOfFilesCount(flags.unit, flags.score);
    RETURN_IF_ERROR(sizesCount);
    const auto parameters = flags.parameters.resolve();
    RETURN_IF_ERROR(parameters);
    ScoreOptions options = flags.score.resolve();
    options.keepScale = *sizesCount;
    auto a = describeFolder(session, flags, *parameters, flags.a);
    RETURN_IF_ERROR(a);
    auto b = describeFolder(session, flags, *parameters, flags.b);
    RETURN_IF_ERROR(b);
    Matched matched{std::move(*a), std::move(*b), {}};
    const auto progress = [&](std::size_t done) {
        session.console().progress("match", done, matched.a.size());
    };
    const RunContext context = session.context();
    const bool verified = flags.verify.resolve(parameters->profile);
    const auto scores = verified
                            ? verifyPairs(matched.a, matched.b, options, flags.verify.options(),
                                          flags.threads, progress, context)
                            : scorePairs(matched.a, matched.b, options, flags.threads, progress, context);
    RETURN_IF_ERROR(scores);
    for (std::size_t i = 0; i < matched.a.size(); ++i) {
        if (!matched.a[i].signature) continue;
        Partner partner = bestOf(*scores, matched, i, flags.threshold);
        const EvaluatedShape& query = matched.a[i];
        if (verified && partner.b) {
            const EvaluatedShape& other = matched.b[*partner.b];
            auto laid = explainVerified(*query.signature, query.surface.get(), *other.signature,
                                        other.surface.get(), options, context);
            RETURN_IF_ERROR(laid);
            partner.verdict = laid->verdict;
            partner.fit = std::move(laid->fit);
        }
        matched.partners.push_back(std::move(partner));
        session.console().progress("lay on each other", i + 1, matched.a.size());
    }
    return matched;
}

json partnerJson(const Matched& matched, const Partner& partner) {
    json entry = {{"file", matched.a[partner.a].path},
                  {"partner", nullptr},
                  {"score", partner.score},
                  {"next_score", partner.nextScore},
                  {"mutual", partner.mutual},
                  {"verdict", verdictJson(partner.verdict)},
                  {"mirrored", mirroredJson(fitsMirrored(partner.fit))}};
    if (partner.b) entry["partner"] = matched.b[*partner.b].path;
    if (partner.fit) {
        entry["residual"] = partner.fit->best.residual;
        entry["matrix"] = matrixOf(partner.fit->best.motion);
    }
    return entry;
}

std::string partnersCsv(const Matched& matched) {
    std::string text = "file,partner,score,next_score,mutual,verdict,mirrored,residual\n";
    for (const Partner& partner : matched.partners) {
        CsvRow row;
        row.add(matched.a[partner.a].path).add(partner.b ? matched.b[*partner.b].path : std::string());
        row.add(partner.score).add(partner.nextScore).add(partner.mutual ? "1" : "0");
        row.add(verdictCell(partner.verdict));
        row.add(mirroredCell(fitsMirrored(partner.fit)));
        row.add(partner.fit ? exactNumber(partner.fit->best.residual) : std::string());
        text += row.line();
    }
    return text;
}

std::string partnersText(const Matched& matched) {
    const auto right = Table::Align::kRight;
    Table table({{"scan"}, {"partner"}, {"score", right}, {""}, {"next", right}, {"mutual"}, {"verdict"}});
    std::size_t found = 0;
    std::size_t mutual = 0;
    for (const Partner& partner : matched.partners) {
        if (partner.b) ++found;
        if (partner.mutual) ++mutual;
        table.add({matched.a[partner.a].name, partner.b ? matched.b[*partner.b].name : "(none)",
                   formatFixed(partner.score, 3), bar(partner.score, 20), formatFixed(partner.nextScore, 3),
                   partner.mutual ? "yes" : "no",
                   likenessText(partner.verdict, fitsMirrored(partner.fit), "scan is part of it")});
    }
    return (table.empty() ? std::string() : table.render() + "\n") +
           formatCount(found, "scan has", "scans have") + " a partner among " +
           formatCount(matched.b.size(), "scan", "scans") + ", " + formatCount(mutual) +
           " of them each other's best\n";
}

CommandResult runMatch(Session& session, const MatchFlags& flags) {
    const auto matched = matchFolders(session, flags);
    RETURN_IF_ERROR(matched);
    Failures failures;
    json failed = json::array();
    for (const auto* shapes : {&matched->a, &matched->b}) {
        for (const EvaluatedShape& shape : *shapes) {
            if (!shape.failure) continue;
            failures.add(shape.path, *shape.failure);
            failed.push_back({{"file", shape.path}, {"error", toJson(*shape.failure)}});
        }
    }
    if (!flags.out.empty()) RETURN_IF_ERROR(writeTextFile(flags.out, partnersCsv(*matched)));
    Console& console = session.console();
    json matches = json::array();
    for (const Partner& partner : matched->partners) {
        json entry = partnerJson(*matched, partner);
        console.item(entry);
        matches.push_back(std::move(entry));
    }
    for (const json& one : failed) console.item(one);
    if (!console.lines()) console.document({{"matches", matches}, {"failed", failed}});
    console.text(flags.csv ? partnersCsv(*matched) : partnersText(*matched));
    if (!flags.out.empty() && !flags.csv) console.text("Matches: " + inLine(flags.out) + "\n");
    const std::size_t all = matched->a.size() + matched->b.size();
    failures.tell(console, all, "file", "files");
    return failures.exitCode(all);
}

}  // namespace

void addMatchCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<MatchFlags>();
    CLI::App* command = app.add_subcommand(
        "match", "Find for each scan of folder A its best partner in folder B (needs no server)");
    command->add_option("FOLDER_A", flags->a, "Scans to find partners for: a folder or one file")->required();
    command->add_option("FOLDER_B", flags->b, "Candidate partners")->required();
    command->add_option("--threshold", flags->threshold, "Below this score there is no partner, 0 to 1")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    command->add_flag("--csv", flags->csv, "Print a line of CSV for each scan of A");
    command->add_option("-o,--out", flags->out, "Write them to a file")
        ->type_name("FILE.csv")
        ->check(endsIn(".csv"));
    command->add_option("--threads", flags->threads, "Number of threads; does not change the result")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    addScoreFlags(*command, flags->score);
    addFreeScaleFlag(*command, flags->score);
    addUnitFlag(*command, flags->unit);
    addVerifyFlags(*command, flags->verify);
    addScanFlags(*command, flags->scan);
    addParameterFlags(*command, flags->parameters);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runMatch(session, *flags); }; });
}

}  // namespace shapedb::cli
