// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench leave-classes-out`: whether the constants of verified search profit from the classes that
// they are judged by. Those that are best on half of the classes are measured on the other half, beside those
// shipped.
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/operations.h"
#include "bench/output.h"
#include "bench/simulated_searches.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "core/base/return_if_error.h"
#include "core/evaluation/metrics.h"
#include "core/search/top_k.h"
#include "core/search/verify.h"
#include "core/synthetic/degrade.h"

namespace shapedb::bench {

namespace {

struct LeaveOutFlags {
    std::vector<std::string> folders;
    std::vector<double> noise{0.0, 0.01};
    std::size_t members = 6;
    std::uint64_t seed = 1;
    unsigned threads = cli::defaultThreads();
};

// What is chosen: the weights of the misfit, and which part of the candidates is verified.
struct Variant {
    double reliable = 0.0;
    double unsure = 0.0;
    double candidates = 0.0;
};

constexpr std::array<double, 5> kReliable{0.25, 0.375, 0.5, 0.625, 0.75};
constexpr std::array<double, 4> kUnsure{0.5, 0.625, 0.75, 0.875};
constexpr std::array<double, 3> kCandidateShares{0.25, 0.5, 1.0};

Variant shipped() {
    return {misfitShare(QueryTraits{true, false, false}, {}),
            misfitShare(QueryTraits{false, false, false}, {}), 1.0};
}

std::vector<Variant> variants() {
    std::vector<Variant> all;
    for (const double reliable : kReliable) {
        for (const double unsure : kUnsure) {
            for (const double candidates : kCandidateShares) all.push_back({reliable, unsure, candidates});
        }
    }
    return all;
}

struct LaidCandidate {
    std::size_t shape = 0;
    double signatureScore = 0.0;
    double misfit = 1.0;  // of an unrelated shape where it was not laid on the query
};

struct LaidQuery {
    QueryTraits traits;
    std::size_t verified = 0;
    std::vector<LaidCandidate> candidates;  // as the signatures rank them
};

// The shapes of half of the classes at one level of noise, each laid on each other that a search would lay on
// it.
struct Half {
    std::vector<std::string> labels;
    std::vector<LaidQuery> queries;
};

Result<LaidQuery> lay(const std::vector<DescribedModel>& shapes, std::size_t query, const SignatureSet& set,
                      const RunContext& context) {
    LaidQuery laid;
    const DescribedModel& own = shapes[query];
    const auto traits = traitsOf(*own.signature, *own.surface);
    RETURN_IF_ERROR(traits);
    laid.traits = *traits;
    SearchOptions options;
    options.k = shapes.size();
    options.excludeId = static_cast<std::int64_t>(query) + 1;
    const auto found = topK(*own.signature, set, options, context);
    RETURN_IF_ERROR(found);
    laid.verified = std::min(candidatesFor(*traits), found->hits.size());
    const FitQuery fitQuery(*own.surface);
    for (std::size_t i = 0; i < found->hits.size(); ++i) {
        LaidCandidate candidate;
        candidate.shape = static_cast<std::size_t>(found->hits[i].id - 1);
        candidate.signatureScore = found->hits[i].score;
        if (i < laid.verified) {
            const auto fitted = fit(fitQuery, *shapes[candidate.shape].surface,
                                    {kindsOfQuery(*traits), false, true}, context);
            RETURN_IF_ERROR(fitted);
            candidate.misfit = fitted->misfit;
        }
        laid.candidates.push_back(candidate);
    }
    return laid;
}

Result<Half> describedHalf(const std::vector<LabelledModel>& models, const std::set<std::string>& classes,
                           double noise, const LeaveOutFlags& flags, const RunContext& context) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < models.size(); ++i) {
        if (classes.count(models[i].label) > 0) members.push_back(i);
    }
    Half half;
    std::vector<DescribedModel> shapes(members.size());
    RETURN_IF_ERROR(
        cli::forEachItem(members.size(), flags.threads, context, [&](std::size_t i) -> std::optional<Error> {
            PointCloud points = models[members[i]].points;
            const auto noisy = addGaussianNoise(points, noise, flags.seed + members[i]);
            if (!noisy) return noisy.error();
            auto shape = describeModel(points, false, context);
            if (!shape) return shape.error();
            if (!shape->signature || !shape->surface)
                return Error{ErrorCode::kNoInterior,
                             models[members[i]].label + ": a shape cannot be described"};
            shapes[i] = std::move(*shape);
            return std::nullopt;
        }));
    std::vector<IndexEntry> entries;
    for (std::size_t i = 0; i < members.size(); ++i) {
        half.labels.push_back(models[members[i]].label);
        entries.push_back({static_cast<std::int64_t>(i) + 1, {}, *shapes[i].signature, nullptr});
    }
    const SignatureSet set = SignatureSet().with(entries, {});
    half.queries.resize(members.size());
    RETURN_IF_ERROR(
        cli::forEachItem(members.size(), flags.threads, context, [&](std::size_t i) -> std::optional<Error> {
            auto laid = lay(shapes, i, set, context);
            if (!laid) return laid.error();
            half.queries[i] = std::move(*laid);
            return std::nullopt;
        }));
    return half;
}

Result<RetrievalMetrics> measure(const Half& half, const Variant& variant) {
    const std::size_t n = half.labels.size();
    ScoreMatrix scores(n * n, 0.0);
    for (std::size_t q = 0; q < n; ++q) {
        const LaidQuery& query = half.queries[q];
        const double share = query.traits.reliable ? variant.reliable : variant.unsure;
        const auto verified =
            static_cast<std::size_t>(variant.candidates * static_cast<double>(query.verified));
        for (std::size_t i = 0; i < query.candidates.size(); ++i) {
            const LaidCandidate& candidate = query.candidates[i];
            scores[q * n + candidate.shape] =
                verifiedScore(candidate.signatureScore, i < verified ? candidate.misfit : 1.0, share);
        }
    }
    const auto report = evaluateLeaveOneOut(scores, half.labels);
    RETURN_IF_ERROR(report);
    return report->mean;
}

// The variant with the largest sum of the mean average precision at all levels of noise.
Result<Variant> bestOn(const std::vector<Half>& levels) {
    Variant best = shipped();
    double most = -1.0;
    for (const Variant& variant : variants()) {
        double sum = 0.0;
        for (const Half& half : levels) {
            const auto metrics = measure(half, variant);
            RETURN_IF_ERROR(metrics);
            sum += metrics->averagePrecision;
        }
        if (sum <= most) continue;
        most = sum;
        best = variant;
    }
    return best;
}

std::string metricsText(const RetrievalMetrics& metrics) {
    return numberText("%.3f", metrics.nearestNeighbour) + " / " + numberText("%.3f", metrics.firstTier) +
           " / " + numberText("%.3f", metrics.averagePrecision);
}

// A row for each level of noise: what is best on `from`, on `to`, beside what is shipped.
Result<std::string> rowsFor(const std::vector<Half>& from, const std::vector<Half>& to,
                            const LeaveOutFlags& flags) {
    const auto classesOf = [](const Half& half) {
        return std::to_string(std::set<std::string>(half.labels.begin(), half.labels.end()).size());
    };
    const auto best = bestOn(from);
    RETURN_IF_ERROR(best);
    std::string text;
    for (std::size_t level = 0; level < to.size(); ++level) {
        const auto chosen = measure(to[level], *best);
        RETURN_IF_ERROR(chosen);
        const auto own = measure(to[level], shipped());
        RETURN_IF_ERROR(own);
        text += "| " + classesOf(from[level]) + " classes | the other " + classesOf(to[level]) + " | " +
                numberText("%g %%", 100.0 * flags.noise[level]) + " | " + numberText("%g", best->reliable) +
                ", " + numberText("%g", best->unsure) + ", " + numberText("%g", best->candidates) + " | " +
                metricsText(*chosen) + " | " + metricsText(*own) + " |\n";
    }
    return text;
}

Result<int> runLeaveOut(const LeaveOutFlags& flags, Bench& bench) {
    const RunContext context = bench.context();
    const auto models = labelledModels(flags.folders, flags.members, flags.seed, context);
    RETURN_IF_ERROR(models);
    std::set<std::string> names;
    for (const LabelledModel& model : *models) names.insert(model.label);
    // Every other class by name.
    std::array<std::set<std::string>, 2> classes;
    std::size_t turn = 0;
    for (const std::string& name : names) classes[turn++ % 2].insert(name);
    if (classes[1].empty()) {
        return fail(ErrorCode::kInvalidArgument, "leaving classes out takes two classes or more");
    }
    std::array<std::vector<Half>, 2> halves;
    for (std::size_t h = 0; h < 2; ++h) {
        for (const double noise : flags.noise) {
            bench.console.progress("halves", 2 * halves[h].size() + h, 2 * flags.noise.size());
            auto half = describedHalf(*models, classes[h], noise, flags, context);
            RETURN_IF_ERROR(half);
            halves[h].push_back(std::move(*half));
        }
    }
    std::string text =
        describe(environment()) + "\n\n" + std::to_string(models->size()) + " shapes of " +
        std::to_string(names.size()) + " classes, " + std::to_string(variants().size()) + " variants, seed " +
        std::to_string(flags.seed) +
        ".\n\n| chosen on | measured on | noise | weights of the misfit, share of the candidates | "
        "chosen: NN / FT / mAP | shipped |\n|---|---|---|---|---|---|\n";
    for (const std::size_t from : {0u, 1u}) {
        const auto rows = rowsFor(halves[from], halves[1 - from], flags);
        RETURN_IF_ERROR(rows);
        text += *rows;
    }
    bench.console.text(text);
    return cli::kOk;
}

}  // namespace

void addLeaveOutOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<LeaveOutFlags>();
    CLI::App* command = app.add_subcommand(
        "leave-classes-out",
        "Chooses the weights of verified search on half of the classes, and measures them on the rest");
    command->add_option("GALLERY", flags->folders, "Folders of class folders; without, synthetic families");
    command->add_option("--noise", flags->noise, "Levels of noise, as shares of the diagonal [0 0.01]");
    command->add_option("--count", flags->members, "Shapes of each synthetic family")->capture_default_str();
    command->add_option("--seed", flags->seed, "Seed for everything")->capture_default_str();
    command->add_option("--threads", flags->threads, "Number of threads")->capture_default_str();
    command->callback(
        [flags, &bench] { bench.action = [flags, &bench] { return runLeaveOut(*flags, bench); }; });
}

}  // namespace shapedb::bench
