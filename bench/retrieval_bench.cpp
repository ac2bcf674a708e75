// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench retrieval`: our profiles beside other descriptors, on the same points in the same run.
#include <cmath>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/operations.h"
#include "bench/output.h"
#include "bench/peers.h"
#include "bench/retrieval_report.h"
#include "bench/retrieval_run.h"
#include "client/cli/checks.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

struct RetrievalFlags {
    cli::TaskFlags task;
    std::vector<double> noise;
    std::vector<std::string> methods;
    bool noRotation = false;
    unsigned threads = cli::defaultThreads();
    cli::ScanFlags scan;
    std::string json;
    std::string markdown;
    std::string plot;
};

/// Of leave-one-out; the scans of a gallery's queries are as noisy as they are.
const std::vector<double> kDefaultNoise = {0.0, 0.005, 0.01};

Result<RetrievalTask> taskOf(const RetrievalFlags& flags) {
    if (!flags.task.gallery.empty() && !flags.plot.empty()) {
        return fail(ErrorCode::kInvalidArgument, "--plot shows leave-one-out only: omit --gallery");
    }
    return cli::retrievalTask(flags.task);
}

RetrievalSettings settingsOf(const RetrievalFlags& flags) {
    RetrievalSettings settings;
    settings.scan = flags.scan;
    settings.rotate = !flags.noRotation;
    settings.threads = flags.threads;
    settings.noise = flags.noise;
    if (settings.noise.empty())
        settings.noise = flags.task.gallery.empty() ? kDefaultNoise : std::vector<double>{0.0};
    return settings;
}

/// Reports every failure once; returns whether a file could not be read.
int reportFailures(cli::Console& console, const std::vector<LevelResult>& levels) {
    bool unreadable = false;
    for (const LevelResult& level : levels) {
        for (const MethodResult& method : level.methods) {
            for (const ScanFailure& failure : method.failures) {
                // An unreadable file is one failure, not one per method.
                if (failure.unreadable && &method != &level.methods.front()) continue;
                unreadable = unreadable || failure.unreadable;
                const std::string who = failure.unreadable ? "" : method.title + ": ";
                const bool named = failure.error.message.find(failure.path) != std::string::npos;
                console.note(who + (named ? "" : failure.path + ": ") + failure.error.message);
            }
        }
    }
    return unreadable ? cli::kSomeFailed : cli::kOk;
}

Result<int> runOperation(Bench& bench, const RetrievalFlags& flags) {
    const auto methods = methodsNamed(flags.methods);
    RETURN_IF_ERROR(methods);
    const auto task = taskOf(flags);
    RETURN_IF_ERROR(task);
    const RetrievalSettings settings = settingsOf(flags);
    const auto levels = runRetrieval(
        *task, settings, *methods,
        [&](const std::string& what, std::size_t done, std::size_t total) {
            bench.console.progress(what, done, total);
        },
        bench.context());
    RETURN_IF_ERROR(levels);
    const RetrievalReportData data{*task, settings, *levels, environment(), peerLibrary()};
    if (!flags.plot.empty()) {
        RETURN_IF_ERROR(writeText(flags.plot, retrievalCharts(*levels)));
    }
    if (!flags.markdown.empty()) {
        RETURN_IF_ERROR(writeText(flags.markdown, retrievalMarkdown(data)));
    }
    RETURN_IF_ERROR(writeJson(bench.console, flags.json, retrievalJson(data)));
    const int exitCode = reportFailures(bench.console, *levels);
    bench.console.text(retrievalText(data));
    return exitCode;
}

}  // namespace

void addRetrievalOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<RetrievalFlags>();
    CLI::App* command = app.add_subcommand(
        "retrieval",
        "Our profiles beside D2 and the descriptors of the Point Cloud Library, on the same points: "
        "leave-one-out over DIR/CLASS/*, or queries against a gallery");
    cli::addTaskFlags(*command, flags->task);
    command->add_option("--methods", flags->methods, "Only these: default, paper, esf, vfh, gasd, d2")
        ->delimiter(',')
        ->type_name("A,B,...");
    CLI::App& scans = cli::addScanFlagsButNoise(*command, flags->scan);
    scans
        .add_option("--noise", flags->noise,
                    "Noise levels: standard deviation as a share of the bounding-box diagonal "
                    "[0,0.005,0.01; with --gallery 0]")
        ->delimiter(',')
        ->check(cli::atLeastZero())
        ->type_name("S,S,...");
    scans.add_flag("--no-rotation", flags->noRotation, "Do not turn each scan at random first");
    command
        ->add_option("--threads", flags->threads,
                     "Scans described at a time; each measurement is one thread's")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    command->add_option("--json", flags->json, "All figures as JSON; '-' is standard output")
        ->type_name("FILE|-");
    command->add_option("--markdown", flags->markdown, "The tables for a document")->type_name("FILE");
    command->add_option("--plot", flags->plot, "Precision over recall, and each measure over the noise")
        ->type_name("FILE.svg");
    command->callback([&bench, flags] {
        announceJson(bench.console, flags->json);
        bench.action = [&bench, flags] { return runOperation(bench, *flags); };
    });
}

}  // namespace shapedb::bench
