// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench segment`: cost of a segmentation beside CGAL's Delaunay triangulation of the same points.
#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "bench/bare_delaunay.h"
#include "bench/measuring.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "client/cli/console.h"
#include "client/io/scan_reader.h"
#include "core/base/return_if_error.h"
#include "core/delaunay/delaunay.h"
#include "core/pipeline.h"
#include "core/preparation/sanitise.h"
#include "core/segmentation/segmentation.h"
#include "core/synthetic/families.h"

namespace shapedb::bench {

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kSeed = 1;
constexpr const char* kFamily = "animal";
constexpr double kMegabyte = 1e6;

struct SegmentFlags {
    std::string file;
    std::size_t points = 0;
    double noise = 0.0005;
    std::vector<std::string> profiles = {"paper", "default"};
    std::size_t repeat = 5;
    std::size_t threads = 2;
    bool noUndecimated = false;
    bool cgalParallel = false;
    std::string json;
};

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

// Times of one stage over all repetitions, in the order the stages ran.
using Stages = std::vector<std::pair<std::string, std::vector<double>>>;

void note(const std::vector<StageTime>& times, Stages& stages) {
    for (std::size_t i = 0; i < times.size(); ++i) {
        if (i == stages.size()) stages.push_back({times[i].stage, {}});
        stages[i].second.push_back(times[i].seconds);
    }
}

// One profile, on all points or as users run it.
struct Lane {
    std::string profile;
    std::vector<double> seconds;
    Stages stages;
    std::size_t size = 0;  // tetrahedra of all points, sites of the decimated
    std::optional<std::size_t> memory;
};

struct Parallel {
    std::vector<double> one;
    std::vector<double> many;
    std::vector<double> bareMany;
};

struct Figures {
    std::string source;
    std::size_t points = 0;
    std::size_t distinct = 0;
    std::vector<double> bare;
    std::size_t bareTetrahedra = 0;
    std::optional<std::size_t> bareMemory;
    std::vector<Lane> undecimated;  // on all points, one thread
    Parallel parallel;
    std::vector<Lane> whole;  // with the profile's decimation, signature included
};

ShapeParameters parametersNamed(const std::string& name) {
    return parametersOf(name == "paper" ? Profile::kPaper : Profile::kDefault);
}

SegmentationOptions undecimatedOptions(const std::string& profile) {
    SegmentationOptions options = parametersNamed(profile).segmentation;
    options.preparation.decimateTo = 0;
    return options;
}

Result<PointCloud> loadPoints(const SegmentFlags& flags, Figures& figures) {
    if (!flags.file.empty()) {
        auto scan = readScan(flags.file);
        RETURN_IF_ERROR(scan);
        figures.source = flags.file.substr(flags.file.find_last_of('/') + 1);
        return std::move(scan->points);
    }
    const auto solid = makeMember(kFamily, 0, kSeed);
    RETURN_IF_ERROR(solid);
    ScanOptions options;
    options.count = flags.points;
    options.noise = flags.noise;
    figures.source = std::string("synthetic ") + kFamily + ", noise " + json(flags.noise).dump();
    return scanOf(*solid, options);
}

// First: children must be forked before any thread starts.
void measureMemory(const SegmentFlags& flags, const PointCloud& scan, const PointCloud& distinct,
                   Figures& figures) {
    const auto limited = [](const std::function<bool()>& work) {
        return peakMemoryOf([&work] {
            const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
            return work();
        });
    };
    for (const std::string& profile : flags.profiles) {
        Lane whole{profile, {}, {}, 0, std::nullopt};
        whole.memory = limited([&] { return describe(scan, parametersNamed(profile)).has_value(); });
        figures.whole.push_back(std::move(whole));
        if (flags.noUndecimated) continue;
        Lane undecimated{profile, {}, {}, 0, std::nullopt};
        undecimated.memory = limited([&] { return segment(scan, undecimatedOptions(profile)).has_value(); });
        figures.undecimated.push_back(std::move(undecimated));
    }
    if (!flags.noUndecimated) {
        figures.bareMemory = peakMemoryOf([&] { return bareDelaunay(distinct).tetrahedra > 0; });
    }
}

Result<void> measureUndecimated(const PointCloud& scan, const PointCloud& distinct, const RunContext& context,
                                Figures& figures) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const BareDelaunay bare = bareDelaunay(distinct);
    figures.bare.push_back(bare.seconds);
    figures.bareTetrahedra = bare.tetrahedra;
    for (Lane& lane : figures.undecimated) {
        const ThreadStopwatch stopwatch;
        const auto found = segment(scan, undecimatedOptions(lane.profile), context);
        lane.seconds.push_back(stopwatch.seconds());
        RETURN_IF_ERROR(found);
        lane.size = found->tetrahedra.size();
        note(found->stages, lane.stages);
    }
    return {};
}

Result<void> measureParallel(const PointCloud& distinct, std::size_t threads, bool withCgal, bool manyFirst,
                             const RunContext& context, Parallel& parallel) {
    for (const bool many : {manyFirst, !manyFirst}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, many ? threads : 1);
        const auto start = Clock::now();
        const auto found = triangulate(distinct, context);
        (many ? parallel.many : parallel.one).push_back(secondsSince(start));
        RETURN_IF_ERROR(found);
        if (many && withCgal) parallel.bareMany.push_back(bareParallelDelaunay(distinct).wallSeconds);
    }
    return {};
}

Result<void> measureWhole(const PointCloud& scan, std::size_t threads, const RunContext& context,
                          Figures& figures) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    for (Lane& lane : figures.whole) {
        if (parametersNamed(lane.profile).segmentation.preparation.decimateTo == 0) continue;
        const auto start = Clock::now();
        const auto found = describe(scan, parametersNamed(lane.profile), context);
        lane.seconds.push_back(secondsSince(start));
        RETURN_IF_ERROR(found);
        lane.size = found->segmentation.sites.size();
        std::vector<StageTime> stages = found->segmentation.stages;
        stages.push_back({"signature", lane.seconds.back() - found->segmentation.totalSeconds});
        note(stages, lane.stages);
    }
    return {};
}

double megabytes(const std::optional<std::size_t>& bytes) {
    return bytes ? static_cast<double>(*bytes) / kMegabyte : 0.0;
}

std::string stageTable(const Stages& stages) {
    std::string text;
    for (const auto& [stage, seconds] : stages) {
        text += "  " + stage + std::string(stage.size() < 14 ? 14 - stage.size() : 1, ' ') +
                numberText("%8.3f s\n", median(seconds));
    }
    return text;
}

std::string textOf(const SegmentFlags& flags, const Figures& f) {
    std::string text = describe(environment()) + "\n" + f.source + ": " + std::to_string(f.points) +
                       " points, " + std::to_string(f.distinct) + " distinct; medians, of ratios too, of " +
                       std::to_string(flags.repeat) + "\n";
    if (!flags.noUndecimated) {
        text += "\nbare CGAL Delaunay, one thread: " + numberText("%.3f s, ", median(f.bare)) +
                std::to_string(f.bareTetrahedra) + " tetrahedra, peak " +
                numberText("%.1f MB\n", megabytes(f.bareMemory));
        for (const Lane& lane : f.undecimated) {
            text += "\n" + lane.profile + " profile, all points, one thread: " +
                    numberText("%.3f s, ratio_to_delaunay ", median(lane.seconds)) +
                    numberText("%.3f; peak ", medianRatio(lane.seconds, f.bare)) +
                    numberText("%.1f MB, ", megabytes(lane.memory)) +
                    numberText("%.3f of the bare one's\n", megabytes(lane.memory) / megabytes(f.bareMemory)) +
                    stageTable(lane.stages);
        }
        text += "\nDelaunay with " + std::to_string(flags.threads) +
                " threads: " + numberText("%.3f s, ", median(f.parallel.many)) +
                numberText("%.2f times as fast as with one (", medianRatio(f.parallel.one, f.parallel.many)) +
                numberText("%.3f s)\n", median(f.parallel.one));
        if (flags.cgalParallel)
            text += numberText("CGAL's parallel one: %.3f s\n", median(f.parallel.bareMany));
    }
    for (const Lane& lane : f.whole) {
        if (lane.seconds.empty()) continue;
        text += "\n" + lane.profile + " profile, " + std::to_string(flags.threads) +
                " threads, points to signature: " + numberText("%.3f s, ", median(lane.seconds)) +
                std::to_string(lane.size) + " sites, peak " +
                numberText("%.1f MB\n", megabytes(lane.memory)) + stageTable(lane.stages);
    }
    return text;
}

json stagesJson(const Stages& stages) {
    json table = json::array();
    for (const auto& [stage, seconds] : stages)
        table.push_back({{"stage", stage}, {"seconds", median(seconds)}});
    return table;
}

json documentOf(const SegmentFlags& flags, const std::string& command, const Figures& f) {
    json document = {{"environment", environmentJson(environment())},
                     {"command", command},
                     {"source", f.source},
                     {"points", f.points},
                     {"distinct", f.distinct},
                     {"repeat", flags.repeat}};
    if (!flags.noUndecimated) {
        document["delaunay"] = {{"seconds", median(f.bare)},
                                {"tetrahedra", f.bareTetrahedra},
                                {"peak_megabytes", megabytes(f.bareMemory)}};
        for (const Lane& lane : f.undecimated) {
            document["undecimated"][lane.profile] = {
                {"seconds", median(lane.seconds)},
                {"ratio_to_delaunay", medianRatio(lane.seconds, f.bare)},
                {"tetrahedra", lane.size},
                {"peak_megabytes", megabytes(lane.memory)},
                {"memory_ratio_to_delaunay", megabytes(lane.memory) / megabytes(f.bareMemory)},
                {"stages", stagesJson(lane.stages)}};
        }
        document["parallel_delaunay"] = {{"threads", flags.threads},
                                         {"one_thread_seconds", median(f.parallel.one)},
                                         {"seconds", median(f.parallel.many)},
                                         {"speed_up", medianRatio(f.parallel.one, f.parallel.many)}};
        if (flags.cgalParallel) {
            document["parallel_delaunay"]["cgal_parallel_seconds"] = median(f.parallel.bareMany);
        }
    }
    for (const Lane& lane : f.whole) {
        if (lane.seconds.empty()) continue;
        document["points_to_signature"][lane.profile] = {{"threads", flags.threads},
                                                         {"seconds", median(lane.seconds)},
                                                         {"sites", lane.size},
                                                         {"peak_megabytes", megabytes(lane.memory)},
                                                         {"stages", stagesJson(lane.stages)}};
    }
    return document;
}

Result<int> runSegment(const SegmentFlags& flags, Bench& bench) {
    Figures figures;
    const RunContext context = bench.context();
    const auto scan = loadPoints(flags, figures);
    RETURN_IF_ERROR(scan);
    figures.points = scan->size();
    PointCloud distinct;
    if (!flags.noUndecimated) {
        auto clean = sanitise(*scan);
        RETURN_IF_ERROR(clean);
        distinct = std::move(clean->points);
        distinct.shrink_to_fit();
    }
    figures.distinct = distinct.size();
    measureMemory(flags, *scan, distinct, figures);
    for (std::size_t i = 0; i < flags.repeat; ++i) {
        bench.console.progress("segment", i, flags.repeat);
        if (!flags.noUndecimated) {
            RETURN_IF_ERROR(measureUndecimated(*scan, distinct, context, figures));
        }
        RETURN_IF_ERROR(measureWhole(*scan, flags.threads, context, figures));
    }
    // In a loop of their own: after seconds on one thread a virtual machine is slow to give the other
    // processors back.
    const std::size_t turns = flags.noUndecimated ? 0 : flags.repeat;
    for (std::size_t i = 0; i < turns; ++i) {
        bench.console.progress("parallel", i, turns);
        if (auto go = measureParallel(distinct, flags.threads, flags.cgalParallel, i % 2 != 0, context,
                                      figures.parallel);
            !go)
            return fail(go.error());
    }
    const json document = documentOf(flags, bench.command, figures);
    RETURN_IF_ERROR(writeJson(bench.console, flags.json, document));
    bench.console.text(textOf(flags, figures));
    return cli::kOk;
}

}  // namespace

void addSegmentOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<SegmentFlags>();
    CLI::App* command = app.add_subcommand(
        "segment",
        "Time and memory of a segmentation beside CGAL's Delaunay triangulation of the same points");
    auto* source = command->add_option_group("source");
    source->add_option("--file", flags->file, "Scan to segment");
    source->add_option("--points", flags->points, "Number of points of a synthetic shape instead")
        ->check(CLI::Range(std::size_t{100}, std::size_t{1000000000}));
    source->require_option(1);
    command->add_option("--noise", flags->noise, "With --points: share of the box diagonal")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    command->add_option("--profile", flags->profiles, "Profiles to measure: paper, default")
        ->delimiter(',')
        ->check(CLI::IsMember({"paper", "default"}))
        ->type_name("A,B");
    command->add_option("--repeat", flags->repeat, "Repetitions; medians are reported")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command
        ->add_option("--threads", flags->threads,
                     "Threads for the parallel triangulation and from points to signature")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    command->add_flag("--no-undecimated", flags->noUndecimated,
                      "Only from points to signature, not the triangulation of all points");
    command->add_flag("--cgal-parallel", flags->cgalParallel, "Measure CGAL's parallel insertion too");
    command->add_option("--json", flags->json, "All figures as JSON; '-' is standard output")
        ->type_name("FILE|-");
    command->callback([&bench, flags] {
        announceJson(bench.console, flags->json);
        bench.action = [&bench, flags] { return runSegment(*flags, bench); };
    });
}

}  // namespace shapedb::bench
