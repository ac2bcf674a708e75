// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench align`: are known motions found?
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/align.h"
#include "bench/measuring.h"
#include "bench/models.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "client/cli/console.h"
#include "client/cli/retrieval_task.h"
#include "client/cli/scan_source.h"
#include "client/io/scan_reader.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/fit/surface_points.h"
#include "core/geometry/box.h"
#include "core/geometry/motion.h"
#include "core/geometry/neighbours.h"
#include "core/synthetic/degrade.h"

namespace shapedb::bench {

namespace {

constexpr double kRightWithin = 0.02;       // error of a motion that counts as found
constexpr std::size_t kErrorPoints = 8000;  // of the model, to measure an error by
constexpr std::size_t kLeastToHalve = 8000;

double squaredGaps(const PointCloud& from, const PointCloud& to) {
    const NeighbourIndex index(to);
    std::vector<Neighbour> found;
    double sum = 0.0;
    for (const Point3& p : from) {
        index.nearest(p, 1, found);
        sum += found.front().squaredDistance;
    }
    return sum;
}

Motion randomMotion(Random& random, double reach, bool mayReflect, bool keepScale) {
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = std::exp2(random.uniform(-1.0, 1.0));
    motion.reflected = random.below(2) == 1 && mayReflect;
    if (keepScale) motion.scale = 1.0;
    if (motion.reflected) {
        for (auto& row : motion.rotation) row[2] = -row[2];
    }
    motion.translation =
        reach * Point3{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
    return motion;
}

bool stopped(const Error& error) {
    return error.code == ErrorCode::kCancelled || error.code == ErrorCode::kDeadlineExceeded;
}

struct Column {
    std::vector<double> errors;
    std::vector<double> scores;
    std::size_t right = 0;
    std::size_t rightOrEqual = 0;
    double seconds = 0.0;
    std::map<FitKind, std::size_t> kinds;

    void add(const AlignOutcome& outcome) {
        errors.push_back(outcome.error);
        scores.push_back(outcome.score);
        right += outcome.error <= kRightWithin ? 1 : 0;
        rightOrEqual += outcome.bestOfEqual <= kRightWithin ? 1 : 0;
        seconds += outcome.seconds;
        ++kinds[outcome.kind];
    }
};

std::string line(const char* name, const Column& column) {
    const double n = static_cast<double>(std::max<std::size_t>(1, column.errors.size()));
    const auto share = [&](std::size_t count) {
        return numberText("%.3f", static_cast<double>(count) / n) + " | ";
    };
    const auto kind = [&](FitKind k) {
        const auto found = column.kinds.find(k);
        return std::to_string(found == column.kinds.end() ? 0 : found->second);
    };
    return std::string("| ") + name + " | " + std::to_string(column.errors.size()) + " | " +
           share(column.right) + share(column.rightOrEqual) +
           numberText("%.2f", 100.0 * median(column.errors)) + " | " +
           numberText("%.3f", median(column.scores)) + " | " + numberText("%.2f", 1e3 * column.seconds / n) +
           " | " + kind(FitKind::kWhole) + " / " + kind(FitKind::kOneSided) + " / " + kind(FitKind::kPiece) +
           " |\n";
}

struct AlignFlags {
    std::vector<std::string> folders;
    std::size_t perFolder = 0;
    AlignSettings settings;
    bool automatic = false;
    bool noReflection = false;
    bool listMisses = false;
    bool peers = false;
};

Result<std::vector<PeerAligner>> peersOf(const AlignFlags& flags) {
    if (!flags.peers) return std::vector<PeerAligner>{};
    auto peers = peerAligners();
    if (peers.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "--peers: built without the Point Cloud Library (preset peers)");
    }
    if (!flags.settings.fit.keepScale || !flags.noReflection) {
        return fail(ErrorCode::kInvalidArgument,
                    "--peers needs --keep-scale and --no-reflection: the peers find rigid motions only");
    }
    return peers;
}

std::string peerLine(const std::string& name, const char* condition, const Column& column) {
    const auto n = static_cast<double>(std::max<std::size_t>(1, column.errors.size()));
    return "| " + name + " | " + condition + " | " + std::to_string(column.errors.size()) + " | " +
           numberText("%.3f", static_cast<double>(column.right) / n) + " | " +
           numberText("%.2f", 100.0 * median(column.errors)) + " | " +
           numberText("%.1f", 1e3 * column.seconds / n) + " |\n";
}

Result<int> runAlign(const AlignFlags& flags, Bench& bench) {
    const auto peers = peersOf(flags);
    RETURN_IF_ERROR(peers);
    AlignSettings settings = flags.settings;
    settings.toldKind = !flags.automatic;
    settings.fit.reflection = !flags.noReflection;
    const auto scans = cli::listCollection(flags.folders);
    RETURN_IF_ERROR(scans);
    std::map<std::string, std::size_t> taken;
    std::array<Column, kAlignConditions.size()> columns;
    std::vector<std::array<Column, kAlignConditions.size()>> peerColumns(peers->size());
    std::string misses;
    for (const auto& scan : *scans) {
        if (flags.perFolder != 0 && taken[scan.label] == flags.perFolder) continue;
        ++taken[scan.label];
        const auto read = readScan(scan.path, {}, bench.context());
        RETURN_IF_ERROR(read);
        for (std::size_t i = 0; i < columns.size(); ++i) {
            const auto one = makeAlignCase(read->points, kAlignConditions[i], settings,
                                           cli::fileSeed(settings.seed, scan.name));
            RETURN_IF_ERROR(one);
            const auto outcome = measureAlignment(*one, kAlignConditions[i], settings, bench.context());
            RETURN_IF_ERROR(outcome);
            columns[i].add(*outcome);
            for (std::size_t p = 0; p < peers->size(); ++p) {
                RETURN_IF_ERROR(bench.context().checkpoint());
                peerColumns[p][i].add(measureAlignment(*one, (*peers)[p]));
            }
            if (!flags.listMisses || outcome->error <= kRightWithin) continue;
            misses += "- " + scan.name + ", " + kAlignConditions[i].name + ": error " +
                      numberText("%.2f", 100.0 * outcome->error) + " %, score " +
                      numberText("%.3f", outcome->score) + "\n";
        }
        bench.console.note(scan.path);
    }
    std::string text =
        describe(environment()) + "\n\nNoise " + numberText("%.2f", 100.0 * settings.noise) +
        " % of the diagonal, seed " + std::to_string(settings.seed) + ", " +
        (settings.fit.keepScale ? "scale kept" : "scale free") + ", " +
        (settings.fit.reflection ? "reflection allowed" : "no reflection") + ", kind " +
        (settings.toldKind ? "told" : "automatic") +
        ".\n\n| query | scans | within 2 % | or an equally good pose is | median error, % | "
        "median score | ms a fit | whole / one-sided / piece |\n|---|---|---|---|---|---|---|---|\n";
    for (std::size_t i = 0; i < columns.size(); ++i) text += line(kAlignConditions[i].name, columns[i]);
    if (!misses.empty()) text += "\n" + misses;
    if (!peers->empty()) {
        text +=
            "\n" + peerLibrary() +
            "\n\n| peer | query | scans | within 2 % | median error, % | ms |\n|---|---|---|---|---|---|\n";
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
        for (std::size_t p = 0; p < peers->size(); ++p) {
            text += peerLine((*peers)[p].name, kAlignConditions[i].name, peerColumns[p][i]);
        }
    }
    bench.console.text(text);
    return cli::kOk;
}

}  // namespace

double motionError(const PointCloud& model, const Motion& found, const Motion& truth) {
    PointCloud some;
    const std::size_t step = std::max<std::size_t>(1, model.size() / kErrorPoints);
    for (std::size_t i = 0; i < model.size(); i += step) some.push_back(model[i]);
    const PointCloud a = applyToCloud(found, some);
    const PointCloud b = applyToCloud(truth, some);
    const double mean = (squaredGaps(a, b) + squaredGaps(b, a)) / static_cast<double>(2 * some.size());
    return std::sqrt(mean) / boxOf(b).diagonal();
}

Result<AlignCase> makeAlignCase(const PointCloud& model, const AlignCondition& condition,
                                const AlignSettings& settings, std::uint64_t seed) {
    Random random(seed);
    PointCloud query = model;
    PointCloud other = model;
    if (model.size() >= kLeastToHalve) {
        query = halfOf(model, 0);
        other = halfOf(model, 1);
    }
    const double diagonal = boxOf(model).diagonal();
    const Point3 direction = randomDirection(random);
    RETURN_IF_ERROR(addGaussianNoise(query, settings.noise, random.next()));
    if (condition.kind == FitKind::kOneSided) query = seenFrom(query, direction);
    if (condition.kind == FitKind::kPiece) query = cutBelow(query, direction, condition.left);
    const Motion queryPose = randomMotion(random, diagonal, settings.fit.reflection, settings.fit.keepScale);
    const Motion otherPose = randomMotion(random, diagonal, false, true);
    return AlignCase{applyToCloud(queryPose, query), applyToCloud(otherPose, other),
                     compose(queryPose, inverse(otherPose))};
}

Result<AlignOutcome> measureAlignment(const AlignCase& one, const AlignCondition& condition,
                                      const AlignSettings& settings, const RunContext& context) {
    AlignOutcome outcome;
    const auto querySurface = makeSurfacePoints(one.query, context);
    const auto otherSurface = makeSurfacePoints(one.other, context);
    for (const auto* surface : {&querySurface, &otherSurface}) {
        if (*surface) continue;
        if (stopped(surface->error())) return fail(surface->error());
        return outcome;
    }
    FitOptions options = settings.fit;
    if (settings.toldKind) options.kinds = FitKinds::only(condition.kind);
    const FitQuery prepared(*querySurface);
    const ThreadStopwatch watch;
    const auto result = align(prepared, *otherSurface, options, context);
    outcome.seconds = watch.seconds();
    RETURN_IF_ERROR(result);
    outcome.score = result->best.score;
    outcome.kind = result->kind;
    outcome.error = motionError(one.other, result->best.motion, one.truth);
    outcome.bestOfEqual = outcome.error;
    for (const FitPose& pose : result->alternatives) {
        outcome.bestOfEqual = std::min(outcome.bestOfEqual, motionError(one.other, pose.motion, one.truth));
    }
    return outcome;
}

AlignOutcome measureAlignment(const AlignCase& one, const PeerAligner& peer) {
    AlignOutcome outcome;
    const ThreadStopwatch watch;
    const auto motion = peer.align(one.query, one.other);
    outcome.seconds = watch.seconds();
    if (motion) outcome.error = motionError(one.other, *motion, one.truth);
    outcome.bestOfEqual = outcome.error;
    return outcome;
}

void addAlignOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<AlignFlags>();
    CLI::App* command =
        app.add_subcommand("align", "Are the motions of whole, one-sided and cut scans found, and how fast?");
    command->add_option("folders", flags->folders, "Folders with clean, whole scans")->required();
    command->add_option("--per-folder", flags->perFolder, "Scans of each folder to take (0: all)");
    command->add_option("--noise", flags->settings.noise, "Standard deviation as a share of the diagonal")
        ->capture_default_str();
    command->add_option("--seed", flags->settings.seed, "Of noise, directions and motions")
        ->capture_default_str();
    command->add_flag("--keep-scale", flags->settings.fit.keepScale, "Both scans have the same unit");
    command->add_flag("--no-reflection", flags->noReflection, "Nothing is mirrored");
    command->add_flag("--automatic", flags->automatic, "Lets the fit find out what is missing");
    command->add_flag("--misses", flags->listMisses, "Lists the scans whose motion is not found");
    command->add_flag("--peers", flags->peers, "Registration by the Point Cloud Library beside it");
    command->callback(
        [flags, &bench] { bench.action = [flags, &bench] { return runAlign(*flags, bench); }; });
}

}  // namespace shapedb::bench
