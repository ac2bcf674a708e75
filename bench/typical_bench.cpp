// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench typical`: measures again what two unrelated shapes differ by.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/measuring.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/typical.h"
#include "client/cli/console.h"
#include "client/cli/scan_source.h"
#include "core/base/return_if_error.h"
#include "core/fit/fit.h"
#include "core/matching/attributed/attribute_distance.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/synthetic/families.h"

namespace shapedb::bench {

namespace {

struct Member {
    std::size_t family = 0;
    Signature signature;
    SurfacePoints surface;
};

constexpr std::array<FitKind, 3> kKinds{FitKind::kWhole, FitKind::kOneSided, FitKind::kPiece};
constexpr std::array<const char*, 3> kKindNames{"misfit, whole", "misfit, one-sided", "misfit, piece"};

Result<Member> describeMember(const std::string& family, std::size_t index, const TypicalSettings& settings,
                              const RunContext& context) {
    const auto solid = makeMember(family, index, settings.seed);
    RETURN_IF_ERROR(solid);
    const std::string number = std::to_string(index + 1);
    const std::string name = family + "/" + family + (number.size() < 2 ? "_0" : "_") + number + ".ply";
    ScanOptions options;
    options.count = settings.points;
    options.noise = settings.noise;
    options.seed = cli::fileSeed(settings.seed, name);
    const auto scan = scanOf(*solid, options);
    RETURN_IF_ERROR(scan);
    auto description = describe(*scan, parametersOf(Profile::kDefault), context);
    RETURN_IF_ERROR(description);
    auto surface = makeSurfacePoints(*scan, context);
    RETURN_IF_ERROR(surface);
    return Member{0, std::move(description->signature), std::move(*surface)};
}

Result<std::vector<Member>> describeMembers(const TypicalSettings& settings, const RunContext& context) {
    const std::vector<FamilyInfo> families = listFamilies();
    std::vector<Member> members;
    for (std::size_t family = 0; family < families.size(); ++family) {
        for (std::size_t index = 0; index < settings.perFamily; ++index) {
            auto member = describeMember(families[family].name, index, settings, context);
            RETURN_IF_ERROR(member);
            member->family = family;
            members.push_back(std::move(*member));
        }
    }
    return members;
}

std::string report(const TypicalResult& result, const TypicalSettings& settings) {
    const auto kept = typicalDifferences();
    std::string text = describe(environment()) + "\n\n" + std::to_string(result.pairs) +
                       " pairs of different families among " + std::to_string(result.shapes) +
                       " synthetic scans of " + std::to_string(settings.points) + " points, noise " +
                       numberText("%.1f", 100.0 * settings.noise) + " % of the diagonal, seed " +
                       std::to_string(settings.seed) +
                       "\n\n| difference | median | constant | ratio |\n|---|---|---|---|\n";
    for (std::size_t i = 0; i < kept.size(); ++i) {
        const std::string name = i < kStatisticKinds ? kStatistics[i].name : "parts";
        text += "| " + name + " | " + numberText("%.2f", result.medians[i]) + " | " +
                numberText("%.2f", kept[i]) + " | " + numberText("%.3f", result.medians[i] / kept[i]) +
                " |\n";
    }
    for (std::size_t k = 0; k < kKinds.size(); ++k) {
        const double constant = typicalMisfit(kKinds[k]);
        text += std::string("| ") + kKindNames[k] + " (" + std::to_string(result.fits) + " pairs) | " +
                numberText("%.2f", result.misfits[k]) + " | " + numberText("%.2f", constant) + " | " +
                numberText("%.3f", result.misfits[k] / constant) + " |\n";
    }
    return text;
}

// 1 - F of b laid on a, by kind.
Result<std::array<double, 3>> misfitsOf(const Member& a, const Member& b, const RunContext& context) {
    const FitQuery query(a.surface);
    std::array<double, 3> misfits{};
    for (std::size_t k = 0; k < kKinds.size(); ++k) {
        FitOptions options;
        options.kinds = FitKinds::only(kKinds[k]);
        const auto result = fit(query, b.surface, options, context);
        RETURN_IF_ERROR(result);
        misfits[k] = 1.0 - result->best.score;
    }
    return misfits;
}

}  // namespace

Result<TypicalResult> measureTypical(const TypicalSettings& settings, const RunContext& context) {
    if (settings.fitEvery == 0) return fail(ErrorCode::kInvalidArgument, "--fit-every must be at least 1");
    if (settings.perFamily == 0) {
        return fail(ErrorCode::kInvalidArgument, "at least one scan of each family is needed");
    }
    const auto members = describeMembers(settings, context);
    RETURN_IF_ERROR(members);
    const auto unit = typicalDifferences();
    std::array<std::vector<double>, kStatisticKinds + 1> differences;
    std::array<std::vector<double>, 3> misfits;
    RunContext quiet = context;
    quiet.progress = nullptr;
    for (std::size_t i = 0; i < members->size(); ++i) {
        for (std::size_t j = i + 1; j < members->size(); ++j) {
            const Member& a = (*members)[i];
            const Member& b = (*members)[j];
            if (a.family == b.family) continue;
            const Explanation explanation = explain(a.signature, b.signature, {});
            for (std::size_t k = 0; k < unit.size(); ++k) {
                differences[k].push_back(explanation.terms[k].distance * unit[k]);
            }
            if (differences.front().size() % settings.fitEvery != 0) continue;
            const auto found = misfitsOf(a, b, quiet);
            RETURN_IF_ERROR(found);
            for (std::size_t k = 0; k < misfits.size(); ++k) misfits[k].push_back((*found)[k]);
        }
        RETURN_IF_ERROR(context.checkpoint());
    }
    TypicalResult result;
    result.shapes = members->size();
    result.pairs = differences.front().size();
    std::transform(differences.begin(), differences.end(), result.medians.begin(), median);
    result.fits = misfits.front().size();
    if (result.fits > 0) std::transform(misfits.begin(), misfits.end(), result.misfits.begin(), median);
    return result;
}

void addTypicalOperation(CLI::App& app, Bench& bench) {
    auto settings = std::make_shared<TypicalSettings>();
    CLI::App* command = app.add_subcommand(
        "typical",
        "Measures what unrelated shapes differ by: the units of the score's terms and of the misfit");
    command->add_option("--count", settings->perFamily, "Scans of each synthetic family")
        ->capture_default_str();
    command->add_option("--points", settings->points, "Points of each scan")->capture_default_str();
    command->add_option("--noise", settings->noise, "Standard deviation as a share of the diagonal")
        ->capture_default_str();
    command->add_option("--fit-every", settings->fitEvery, "Lay each so-many-th pair on each other")
        ->capture_default_str();
    command->add_option("--seed", settings->seed, "Seed for shapes, poses and noise")->capture_default_str();
    command->callback([settings, &bench] {
        bench.action = [settings, &bench]() -> Result<int> {
            const auto result = measureTypical(*settings, bench.context());
            RETURN_IF_ERROR(result);
            bench.console.text(report(*result, *settings));
            return cli::kOk;
        };
    });
}

}  // namespace shapedb::bench
