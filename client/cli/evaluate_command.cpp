// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb evaluate`: how well the method finds shapes of the same class (leave-one-out), or the right
// entries of a gallery; needs no server.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "client/cli/figure.h"
#include "client/cli/parameters.h"
#include "client/cli/retrieval_task.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"
#include "core/evaluation/similarity_matrix.h"

namespace shapedb::cli {

using nlohmann::json;

namespace {

struct EvaluateFlags {
    TaskFlags task;
    std::string confusion;
    bool perClass = false;
    unsigned threads = defaultThreads();
    ScanFlags scan;
    std::optional<LengthUnit> unit;
    ParameterFlags parameters;
    ScoreFlags score;
    VerifyFlags verify;
};

struct Timing {
    double segment = 0.0;  ///< wall clock, reading included
    double match = 0.0;    ///< wall clock
};

class Stopwatch {
  public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(RunContext::Clock::now() - start_).count();
    }

  private:
    RunContext::Clock::time_point start_ = RunContext::Clock::now();
};

bool isSegmentationFailure(const Error& error) {
    switch (error.code) {
        case ErrorCode::kTooFewPoints:
        case ErrorCode::kAllPointsEqual:
        case ErrorCode::kCollinear:
        case ErrorCode::kCoplanar:
        case ErrorCode::kNoInterior: return true;
        default: return false;
    }
}

json failuresJson(const std::vector<const EvaluatedShape*>& failures) {
    json list = json::array();
    for (const EvaluatedShape* shape : failures) {
        list.push_back({{"file", shape->path},
                        {"error", errorCodeName(shape->failure->code)},
                        {"message", shape->failure->message}});
    }
    return list;
}

/// As in a collection with that unit, sizes count if the files have one.
ScoreOptions scoreOptions(const EvaluateFlags& flags) {
    ScoreOptions options = flags.score.resolve();
    const bool haveUnit = flags.unit.value_or(LengthUnit::kNone) != LengthUnit::kNone;
    if (haveUnit && !flags.score.freeScale) options.keepScale = true;
    return options;
}

json settingsJson(const EvaluateFlags& flags, const ShapeParameters& parameters) {
    json settings = {
        {"parameters", toJson(parameters)},
        {"noise", flags.scan.noise},
        {"seed", flags.scan.seed},
        {"points", flags.scan.points ? json(*flags.scan.points) : json(nullptr)},
        {"threads", flags.threads},
        {"reflection", !flags.score.noReflection},
        {"keep_scale", scoreOptions(flags).keepScale},
        {"partial", flags.score.partial},
        {"verify", flags.verify.resolve(parameters.profile)},
        {"candidates", flags.verify.candidates > 0 ? json(flags.verify.candidates) : json(nullptr)}};
    if (!flags.task.classes.only.empty()) settings["only_classes"] = flags.task.classes.only;
    if (!flags.task.classes.except.empty()) settings["except_classes"] = flags.task.classes.except;
    return settings;
}

std::string settingsText(const EvaluateFlags& flags, const ShapeParameters& parameters) {
    std::string text = std::string("profile ") + profileName(parameters.profile);
    text += flags.scan.noise > 0.0 ? ", noise " + formatPercent(flags.scan.noise) +
                                         " of the diagonal (seed " + std::to_string(flags.scan.seed) + ")"
                                   : ", no noise added";
    if (flags.scan.points) text += ", " + formatCount(*flags.scan.points) + " points each";
    if (!flags.verify.resolve(parameters.profile)) return text + ", not verified";
    text += flags.verify.candidates > 0
                ? ", up to " + formatCount(flags.verify.candidates, "candidate", "candidates") + " verified"
                : ", verified";
    return text;
}

std::string timingText(const Timing& timing, std::size_t shapes, std::size_t pairs) {
    return "Segmented " + formatCount(shapes, "scan", "scans") + " in " + formatSeconds(timing.segment) +
           ", matched " + formatCount(pairs, "pair", "pairs") + " in " + formatSeconds(timing.match) + ".\n";
}

/// Prints the failures. The exit code tells whether anything other than a segmentation failed.
int reportFailures(Session& session, const std::vector<const EvaluatedShape*>& failures) {
    bool unreadable = false;
    for (const EvaluatedShape* shape : failures) {
        const std::string& message = shape->failure->message;
        const bool named = message.find(shape->path) != std::string::npos;
        session.console().note(named ? message : shape->path + ": " + message);
        unreadable = unreadable || !isSegmentationFailure(*shape->failure);
    }
    return unreadable ? kSomeFailed : kOk;
}

void collectFailures(const std::vector<EvaluatedShape>& shapes,
                     std::vector<const EvaluatedShape*>& failures) {
    for (const EvaluatedShape& shape : shapes) {
        if (shape.failure) failures.push_back(&shape);
    }
}

Result<void> describeAll(Session& session, const char* what, std::vector<EvaluatedShape>& shapes,
                         const ScanFlags& scan, const EvaluateFlags& flags,
                         const ShapeParameters& parameters) {
    return describeShapes(
        shapes, scan, parameters, flags.verify.resolve(parameters.profile), flags.threads,
        [&](std::size_t done) { session.console().progress(what, done, shapes.size()); }, session.context());
}

Result<ScoreMatrix> scoresOf(Session& session, const std::vector<EvaluatedShape>& queries,
                             const std::vector<EvaluatedShape>& candidates, const EvaluateFlags& flags,
                             const ShapeParameters& parameters) {
    const auto progress = [&](std::size_t done) {
        session.console().progress("match", done, queries.size());
    };
    const ScoreOptions options = scoreOptions(flags);
    if (!flags.verify.resolve(parameters.profile)) {
        return scorePairs(queries, candidates, options, flags.threads, progress, session.context());
    }
    return verifyPairs(queries, candidates, options, flags.verify.options(), flags.threads, progress,
                       session.context());
}

// ---------------------------------------------------------------------------------- leave one out

json metricsJson(const RetrievalMetrics& metrics) {
    return {{"nn", metrics.nearestNeighbour},
            {"first_tier", metrics.firstTier},
            {"second_tier", metrics.secondTier},
            {"dcg", metrics.dcg},
            {"map", metrics.averagePrecision}};
}

json leaveOneOutJson(const EvaluateFlags& flags, const ShapeParameters& parameters,
                     const RetrievalReport& report, const std::vector<EvaluatedShape>& shapes,
                     const std::vector<const EvaluatedShape*>& failures, const Timing& timing) {
    json document = metricsJson(report.mean);
    document.update(settingsJson(flags, parameters));
    document["queries"] = report.queries;
    document["shapes"] = shapes.size();
    document["lonely"] = report.lonely;
    document["classes"] = report.perClass.size();
    document["seconds_segment"] = timing.segment;
    document["seconds_match"] = timing.match;
    document["failures"] = failuresJson(failures);
    if (flags.perClass) {
        json classes = json::object();
        for (const ClassMetrics& one : report.perClass) {
            classes[one.name] = metricsJson(one.mean);
            classes[one.name]["queries"] = one.queries;
        }
        document["per_class"] = classes;
    }
    return document;
}

std::vector<std::string> metricCells(const RetrievalMetrics& metrics) {
    std::vector<std::string> cells;
    for (const double value : {metrics.nearestNeighbour, metrics.firstTier, metrics.secondTier, metrics.dcg,
                               metrics.averagePrecision}) {
        cells.push_back(formatFixed(value, 3));
    }
    return cells;
}

std::string leaveOneOutText(const EvaluateFlags& flags, const ShapeParameters& parameters,
                            const RetrievalReport& report, const std::vector<EvaluatedShape>& shapes,
                            const std::vector<const EvaluatedShape*>& failures, const Timing& timing) {
    std::string text = formatCount(report.queries, "query", "queries") + ", each against all others of " +
                       formatCount(shapes.size(), "shape", "shapes") + " in " +
                       formatCount(report.perClass.size(), "class", "classes") + "; " +
                       settingsText(flags, parameters) + "\n\n";
    const auto right = Table::Align::kRight;
    Table table({{"class"},
                 {"queries", right},
                 {"NN", right},
                 {"1st tier", right},
                 {"2nd tier", right},
                 {"DCG", right},
                 {"mAP", right}});
    const auto add = [&](const std::string& name, std::size_t queries, const RetrievalMetrics& metrics) {
        std::vector<std::string> cells = {name, formatCount(queries)};
        for (std::string& cell : metricCells(metrics)) cells.push_back(std::move(cell));
        table.add(std::move(cells));
    };
    if (flags.perClass) {
        for (const ClassMetrics& one : report.perClass) add(one.name, one.queries, one.mean);
    }
    add("all", report.queries, report.mean);
    text += table.render() + "\n";
    if (report.lonely > 0) {
        text += formatCount(report.lonely, "shape is", "shapes are") + " alone in a class: no query.\n";
    }
    if (!failures.empty()) {
        text += formatCount(failures.size(), "shape", "shapes") +
                " could not be segmented; they count as matching nothing.\n";
    }
    // Partial and verified scores have a direction: each pair is scored both ways.
    const bool directed = flags.score.partial || flags.verify.resolve(parameters.profile);
    const std::size_t pairs = shapes.size() * (shapes.size() - 1) / (directed ? 1 : 2);
    return text + timingText(timing, shapes.size(), pairs);
}

CommandResult runLeaveOneOut(Session& session, const EvaluateFlags& flags) {
    if (!flags.confusion.empty()) {
        RETURN_IF_ERROR(checkFigurePath(flags.confusion));
    }
    const auto parameters = flags.parameters.resolve();
    RETURN_IF_ERROR(parameters);
    const auto task = retrievalTask(flags.task);
    RETURN_IF_ERROR(task);
    std::vector<EvaluatedShape> shapes = shapesOf(task->queries);

    Timing timing;
    const Stopwatch segmenting;
    RETURN_IF_ERROR(describeAll(session, "segment", shapes, flags.scan, flags, *parameters));
    timing.segment = segmenting.seconds();
    const Stopwatch matching;
    const auto scores = scoresOf(session, shapes, shapes, flags, *parameters);
    RETURN_IF_ERROR(scores);
    timing.match = matching.seconds();

    std::vector<std::string> labels;
    std::vector<bool> failed;
    for (const EvaluatedShape& shape : shapes) {
        labels.push_back(shape.label);
        failed.push_back(shape.failure.has_value());
    }
    // Failed pairs score 0, the lowest score there is.
    const auto report = evaluateLeaveOneOut(withTiesAgainstFailures(*scores, labels, failed, -1.0), labels);
    RETURN_IF_ERROR(report);
    if (!flags.confusion.empty()) {
        const auto raster = drawSimilarityMatrix(*scores, labels);
        RETURN_IF_ERROR(raster);
        RETURN_IF_ERROR(writeSimilarityFigure(*raster, flags.confusion));
    }
    std::vector<const EvaluatedShape*> failures;
    collectFailures(shapes, failures);
    Console& console = session.console();
    const int exitCode = reportFailures(session, failures);
    console.document(leaveOneOutJson(flags, *parameters, *report, shapes, failures, timing));
    console.text(leaveOneOutText(flags, *parameters, *report, shapes, failures, timing));
    if (!flags.confusion.empty()) console.text("Similarity matrix: " + inLine(flags.confusion) + "\n");
    return exitCode;
}

// ---------------------------------------------------------------------------------------- gallery

/// The outcome of one query.
struct RankedQuery {
    const EvaluatedShape* query = nullptr;
    const EvaluatedShape* best = nullptr;   ///< null when nothing was ranked
    const EvaluatedShape* right = nullptr;  ///< first right entry; null when there is none
    double bestScore = 0.0;
    double rightScore = 0.0;
    std::size_t rank = 0;  ///< from 1; 0: not found
};

json galleryJson(const EvaluateFlags& flags, const ShapeParameters& parameters, const GalleryReport& report,
                 const std::vector<RankedQuery>& ranked, std::size_t gallerySize,
                 const std::vector<const EvaluatedShape*>& failures, const Timing& timing) {
    json document = settingsJson(flags, parameters);
    document["match"] = flags.task.match;
    document["queries"] = report.queries;
    document["without_right_answer"] = report.withoutRightAnswer;
    document["gallery"] = gallerySize;
    document["hit_at_1"] = report.hitAt1;
    document["hit_at_5"] = report.hitAt5;
    document["mrr"] = report.meanReciprocalRank;
    document["seconds_segment"] = timing.segment;
    document["seconds_match"] = timing.match;
    document["failures"] = failuresJson(failures);
    json ranks = json::array();
    for (const RankedQuery& one : ranked) {
        json entry = {{"query", one.query->path}, {"rank", one.rank}};
        if (one.best != nullptr) entry.update({{"best", one.best->path}, {"best_score", one.bestScore}});
        if (one.right != nullptr) entry.update({{"right", one.right->path}, {"right_score", one.rightScore}});
        ranks.push_back(entry);
    }
    document["ranks"] = ranks;
    return document;
}

std::string galleryText(const EvaluateFlags& flags, const ShapeParameters& parameters,
                        const GalleryReport& report, const std::vector<RankedQuery>& ranked,
                        std::size_t gallerySize, const Timing& timing) {
    std::string text = formatCount(ranked.size(), "query", "queries") + " against a gallery of " +
                       formatCount(gallerySize, "shape", "shapes") + "; right answers have the same " +
                       (flags.task.match == "stem" ? "file name" : "folder name") + "; " +
                       settingsText(flags, parameters) + "\n\n";
    const auto right = Table::Align::kRight;
    Table table(
        {{"query"}, {"rank", right}, {"first hit"}, {"score", right}, {"right answer"}, {"score", right}});
    for (const RankedQuery& one : ranked) {
        table.add(
            {one.query->name, one.rank > 0 ? std::to_string(one.rank) : "-",
             one.best != nullptr ? one.best->name : "-",
             one.best != nullptr ? formatFixed(one.bestScore, 3) : "",
             one.right != nullptr ? one.right->name : (one.query->failure ? "-" : "none in the gallery"),
             one.right != nullptr ? formatFixed(one.rightScore, 3) : ""});
    }
    text += table.render() + "\n";
    text += "hit at 1 " + formatFixed(report.hitAt1, 3) + ", hit at 5 " + formatFixed(report.hitAt5, 3) +
            ", mean reciprocal rank " + formatFixed(report.meanReciprocalRank, 3) + " over " +
            formatCount(report.queries, "query", "queries") + " with a right answer\n";
    return text + timingText(timing, ranked.size() + gallerySize, ranked.size() * gallerySize);
}

std::vector<RankedQuery> tellRanks(const std::vector<EvaluatedShape>& queries,
                                   const std::vector<EvaluatedShape>& gallery, const ScoreMatrix& scores,
                                   const std::vector<GalleryQuery>& asked, const GalleryReport& report) {
    std::vector<RankedQuery> ranked;
    for (std::size_t q = 0; q < queries.size(); ++q) {
        const double* row = scores.data() + q * gallery.size();
        RankedQuery one;
        one.query = &queries[q];
        one.rank = report.firstRightRank[q];
        if (!asked[q].ranking.empty()) {
            one.best = &gallery[asked[q].ranking.front()];
            one.bestScore = row[asked[q].ranking.front()];
        }
        if (one.rank > 0) {
            const std::size_t entry = asked[q].ranking[one.rank - 1];
            one.right = &gallery[entry];
            one.rightScore = row[entry];
        } else if (!asked[q].right.empty()) {
            one.right = &gallery[asked[q].right.front()];
        }
        ranked.push_back(one);
    }
    return ranked;
}

CommandResult runGallery(Session& session, const EvaluateFlags& flags) {
    if (!flags.confusion.empty() || flags.perClass) {
        return fail(ErrorCode::kInvalidArgument, "--confusion and --per-class do not work with --gallery");
    }
    const auto parameters = flags.parameters.resolve();
    RETURN_IF_ERROR(parameters);
    const auto task = retrievalTask(flags.task);
    RETURN_IF_ERROR(task);
    std::vector<EvaluatedShape> queries = shapesOf(task->queries);
    std::vector<EvaluatedShape> gallery = shapesOf(task->gallery);

    // The gallery stands for what a user has stored: noise and subset are for the queries alone.
    ScanFlags clean = flags.scan;
    clean.noise = 0.0;
    clean.points.reset();
    Timing timing;
    const Stopwatch segmenting;
    RETURN_IF_ERROR(describeAll(session, "queries", queries, flags.scan, flags, *parameters));
    RETURN_IF_ERROR(describeAll(session, "gallery", gallery, clean, flags, *parameters));
    timing.segment = segmenting.seconds();
    const Stopwatch matching;
    const auto scores = scoresOf(session, queries, gallery, flags, *parameters);
    RETURN_IF_ERROR(scores);
    timing.match = matching.seconds();

    std::vector<GalleryQuery> asked;
    for (std::size_t q = 0; q < queries.size(); ++q) {
        asked.push_back(
            rankGallery(task->match, queries[q], task->gallery, scores->data() + q * gallery.size(),
                        [&](std::size_t g) { return queries[q].signature && gallery[g].signature; }));
    }
    const auto report = evaluateGallery(asked, gallery.size());
    RETURN_IF_ERROR(report);
    const auto ranked = tellRanks(queries, gallery, *scores, asked, *report);
    std::vector<const EvaluatedShape*> failures;
    collectFailures(queries, failures);
    collectFailures(gallery, failures);
    const int exitCode = reportFailures(session, failures);
    session.console().document(
        galleryJson(flags, *parameters, *report, ranked, gallery.size(), failures, timing));
    session.console().text(galleryText(flags, *parameters, *report, ranked, gallery.size(), timing));
    return exitCode;
}

}  // namespace

void addEvaluateCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<EvaluateFlags>();
    CLI::App* command =
        app.add_subcommand("evaluate",
                           "Measure retrieval on labelled scans (needs no server): leave-one-out over "
                           "DIR/CLASS/*, or queries against a gallery");
    addTaskFlags(*command, flags->task);
    command
        ->add_option("--confusion", flags->confusion,
                     "Draw the similarity matrix (as in the paper's Figure 6)")
        ->type_name("FILE.png|svg");
    command->add_flag("--per-class", flags->perClass, "Also print the figures of each class");
    command->add_option("--threads", flags->threads, "Number of threads; does not change the result")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    addScanFlags(*command, flags->scan);
    addParameterFlags(*command, flags->parameters);
    addUnitFlag(*command, flags->unit);
    addScoreFlags(*command, flags->score);
    addFreeScaleFlag(*command, flags->score);
    addVerifyFlags(*command, flags->verify);
    command->callback([&session, flags] {
        session.action = [&session, flags] {
            return flags->task.gallery.empty() ? runLeaveOneOut(session, *flags)
                                               : runGallery(session, *flags);
        };
    });
}

}  // namespace shapedb::cli
