// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench find`: how often a search finds the shape that its query was made of, and how long it takes.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <tbb/task_arena.h>

#include "bench/measuring.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/signature_generator.h"
#include "bench/simulated_searches.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "core/base/return_if_error.h"
#include "core/search/top_k.h"
#include "core/search/verify.h"

namespace shapedb::bench {

namespace {

struct FindFlags {
    std::vector<std::string> gallery;
    std::vector<std::string> changes;  // flags of kChanges; empty: all
    std::size_t members = 6;
    std::size_t perClass = 0;  // that queries are made of; 0: all
    std::uint64_t fill = 0;
    std::uint64_t seed = 1;
    std::size_t candidates = 0;
    ScoreOptions score;
    bool noReflection = false;
    std::string json;
    unsigned threads = cli::defaultThreads();
};

struct Found {
    Change change = Change::kRescan;
    std::size_t model = 0;
    std::size_t rank = 0;  // of the right shape, from 1; 0: not among the hits
    bool exact = false;
    std::size_t verified = 0;
    double seconds = 0.0;            // of the verified search
    double secondsUnverified = 0.0;  // of the signatures alone
};

struct Study {
    std::vector<Found> found;
    std::size_t shapes = 0;
    std::size_t failures = 0;
};

// Further shapes that nothing was made of: their signatures are generated, and their surface points and views
// are those of the gallery's shapes in turn.
Result<SignatureSet> setOf(Gallery& gallery, const FindFlags& flags, const RunContext& context) {
    if (flags.fill > 0) {
        SignatureGenerator::Options options;
        options.expected = flags.fill;
        options.seed = flags.seed;
        const auto generator = SignatureGenerator::create(options, context);
        RETURN_IF_ERROR(generator);
        for (std::uint64_t i = 0; i < flags.fill; ++i) {
            RETURN_IF_ERROR(context.checkpoint());
            const auto id = static_cast<std::int64_t>(gallery.shapes.size() + i + 1);
            gallery.entries.push_back(
                {id, {}, generator->make(i), gallery.shapes[i % gallery.shapes.size()].views});
        }
    }
    return SignatureSet().with(gallery.entries, {});
}

Result<Found> findOne(const DescribedModel& query, std::size_t model, Change change, const Gallery& gallery,
                      const SignatureSet& set, const FindFlags& flags, const RunContext& context) {
    SearchOptions options;
    options.score = flags.score;
    options.score.reflection = !flags.noReflection;
    options.k = 10;
    VerifyOptions verify;
    verify.mostCandidates = flags.candidates;
    const SurfaceOf surfaceOf = [&](std::int64_t id) -> Result<std::shared_ptr<const SurfacePoints>> {
        return gallery.shapes[static_cast<std::size_t>(id - 1) % gallery.shapes.size()].surface;
    };
    // One after the other, so that both see the machine alike.
    const auto plain = topK(*query.signature, set, options, context);
    RETURN_IF_ERROR(plain);
    const auto result =
        topKVerified(*query.signature, *query.surface, set, options, verify, surfaceOf, context);
    RETURN_IF_ERROR(result);
    Found found{change, model, 0, result->exact, result->verified, result->seconds, plain->seconds};
    for (std::size_t i = 0; i < result->hits.size(); ++i) {
        if (result->hits[i].id == static_cast<std::int64_t>(model) + 1) found.rank = i + 1;
    }
    return found;
}

// The models that queries are made of.
std::vector<std::size_t> chosenModels(const std::vector<LabelledModel>& models, std::size_t perClass) {
    std::vector<std::size_t> chosen;
    std::map<std::string, std::size_t> taken;
    for (std::size_t i = 0; i < models.size(); ++i) {
        if (perClass == 0 || taken[models[i].label]++ < perClass) chosen.push_back(i);
    }
    return chosen;
}

std::vector<Change> chosenChanges(const FindFlags& flags) {
    std::vector<Change> changes;
    for (const ChangeInfo& info : kChanges) {
        const bool named =
            std::find(flags.changes.begin(), flags.changes.end(), info.flag) != flags.changes.end();
        if (named || flags.changes.empty()) changes.push_back(info.change);
    }
    return changes;
}

Result<Study> study(const FindFlags& flags, Bench& bench) {
    const RunContext context = bench.context();
    const auto models = labelledModels(flags.gallery, flags.members, flags.seed, context);
    RETURN_IF_ERROR(models);
    auto gallery = describeGallery(*models, flags.threads, context);
    RETURN_IF_ERROR(gallery);
    const auto set = setOf(*gallery, flags, context);
    RETURN_IF_ERROR(set);
    const auto chosen = chosenModels(*models, flags.perClass);
    const auto changes = chosenChanges(flags);
    std::vector<DescribedModel> queries(chosen.size() * changes.size());
    RETURN_IF_ERROR(
        cli::forEachItem(queries.size(), flags.threads, context, [&](std::size_t q) -> std::optional<Error> {
            const std::size_t model = chosen[q / changes.size()];
            const auto cloud = makeQuery((*models)[model].points, changes[q % changes.size()],
                                         flags.seed + 1000 * q, context);
            if (!cloud) return cloud.error();
            auto query = describeModel(*cloud, false, context);
            if (!query) return query.error();
            queries[q] = std::move(*query);
            return std::nullopt;
        }));
    Study result;
    result.shapes = set->size();
    tbb::task_arena arena(static_cast<int>(flags.threads));
    for (std::size_t q = 0; q < queries.size(); ++q) {
        bench.console.progress("searches", q, queries.size());
        if (!queries[q].signature) {
            ++result.failures;
            continue;
        }
        auto found = arena.execute([&] {
            return findOne(queries[q], chosen[q / changes.size()], changes[q % changes.size()], *gallery,
                           *set, flags, context);
        });
        RETURN_IF_ERROR(found);
        result.found.push_back(*found);
    }
    return result;
}

std::string table(const Study& study) {
    std::string text =
        "| query | queries | first | mrr | among ten | exact | verified, median | ms, median | ms, 95 % | "
        "signatures alone, ms |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for (const ChangeInfo& info : kChanges) {
        std::vector<double> seconds;
        std::vector<double> plain;
        std::vector<double> verified;
        double first = 0.0;
        double reciprocal = 0.0;
        double listed = 0.0;
        double exact = 0.0;
        for (const Found& one : study.found) {
            if (one.change != info.change) continue;
            seconds.push_back(one.seconds);
            plain.push_back(one.secondsUnverified);
            verified.push_back(static_cast<double>(one.verified));
            first += one.rank == 1 ? 1.0 : 0.0;
            reciprocal += one.rank > 0 ? 1.0 / static_cast<double>(one.rank) : 0.0;
            listed += one.rank > 0 ? 1.0 : 0.0;
            exact += one.exact ? 1.0 : 0.0;
        }
        if (seconds.empty()) continue;
        const auto n = static_cast<double>(seconds.size());
        text += std::string("| ") + info.description + " | " + std::to_string(seconds.size()) + " | ";
        for (const double share : {first, reciprocal, listed, exact}) {
            text += numberText("%.3f", share / n) + " | ";
        }
        text += numberText("%.0f", median(verified)) + " | " + numberText("%.0f", 1e3 * median(seconds)) +
                " | " + numberText("%.0f", 1e3 * percentile(seconds, 0.95)) + " | " +
                numberText("%.1f", 1e3 * median(plain)) + " |\n";
    }
    return text;
}

nlohmann::json rowsOf(const Study& study) {
    nlohmann::json rows = nlohmann::json::array();
    for (const Found& one : study.found) {
        rows.push_back({{"change", infoOf(one.change).flag},
                        {"model", one.model},
                        {"rank", one.rank},
                        {"exact", one.exact},
                        {"verified", one.verified},
                        {"seconds", one.seconds},
                        {"seconds_unverified", one.secondsUnverified}});
    }
    return rows;
}

Result<int> run(const FindFlags& flags, Bench& bench) {
    announceJson(bench.console, flags.json);
    const auto result = study(flags, bench);
    RETURN_IF_ERROR(result);
    bench.console.text(describe(environment()) + "\n\nGallery of " + std::to_string(result->shapes) +
                       " shapes, seed " + std::to_string(flags.seed) + ", " + std::to_string(flags.threads) +
                       " threads; " + std::to_string(result->failures) +
                       " queries could not be described.\n\n" + table(*result));
    RETURN_IF_ERROR(writeJson(bench.console, flags.json, rowsOf(*result)));
    return cli::kOk;
}

}  // namespace

void addFindOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<FindFlags>();
    CLI::App* command = app.add_subcommand(
        "find", "Measures how often a search finds the shape that its query was made of, and how fast");
    std::vector<std::string> names;
    for (const ChangeInfo& info : kChanges) names.emplace_back(info.flag);
    command->add_option("GALLERY", flags->gallery, "Folders of class folders; without, synthetic families");
    command->add_option("--change", flags->changes, "How queries are made of shapes; several may be named")
        ->check(CLI::IsMember(names));
    command->add_option("--count", flags->members, "Shapes of each synthetic family")->capture_default_str();
    command->add_option("--per-class", flags->perClass,
                        "Make queries of so many shapes of a class; 0: of all");
    command->add_option("--fill", flags->fill, "Add so many generated shapes to the gallery");
    command->add_option("--candidates", flags->candidates, "Verify at most so many; 0: as the server does");
    command->add_flag("--partial", flags->score.partial, "Tell the search that queries are pieces");
    command->add_flag("--keep-scale", flags->score.keepScale, "Let sizes count");
    command->add_flag("--no-reflection", flags->noReflection, "A mirror image is another shape");
    command->add_option("--seed", flags->seed, "Seed for everything")->capture_default_str();
    command->add_option("--threads", flags->threads, "Number of threads")->capture_default_str();
    command->add_option("--json", flags->json, "Write every search to this file, or - for standard output");
    command->callback([flags, &bench] { bench.action = [flags, &bench] { return run(*flags, bench); }; });
}

}  // namespace shapedb::bench
