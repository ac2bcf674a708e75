// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb compare`: the score of two stored shapes, or of two files without a server, explained.
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/fit_output.h"
#include "client/cli/local_result.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "core/base/return_if_error.h"
#include "core/search/verify.h"

namespace shapedb::cli {

namespace {

struct CompareFlags {
    std::string a;
    std::string b;
    std::string collection;
    bool files = false;
    ScoreFlags score;
    std::optional<LengthUnit> unit;
    ScanFlags scan;
    ParameterFlags parameters;
};

struct Described {
    Signature signature;
    std::optional<SurfacePoints> surface;
};

Result<Described> describeFile(Session& session, const CompareFlags& flags, const ShapeParameters& parameters,
                               const std::string& path) {
    const RunContext context = session.context();
    const auto scan = loadScan(path, flags.scan, flags.scan.seed, context);
    RETURN_IF_ERROR(scan);
    auto description = describe(scan->points, parameters, context);
    if (!description) return fail(withContext(description.error(), scanName(path) + ": "));
    Described described{std::move(description->signature), std::nullopt};
    // Without surface points signatures alone are compared.
    auto surface = makeSurfacePoints(scan->points, context);
    if (surface) described.surface = std::move(*surface);
    RETURN_IF_ERROR(context.checkpoint());
    return described;
}

Result<client::Comparison> compareFiles(Session& session, const CompareFlags& flags) {
    const auto sizesCount = sizesOfFilesCount(flags.unit, flags.score);
    RETURN_IF_ERROR(sizesCount);
    const auto parameters = flags.parameters.resolve();
    RETURN_IF_ERROR(parameters);
    RETURN_IF_ERROR(checkReadOnce(flags.a, flags.b));
    const auto a = describeFile(session, flags, *parameters, flags.a);
    RETURN_IF_ERROR(a);
    const auto b = describeFile(session, flags, *parameters, flags.b);
    RETURN_IF_ERROR(b);
    ScoreOptions options = flags.score.resolve();
    options.keepScale = *sizesCount;
    const auto surfaceOf = [](const Described& one) { return one.surface ? &*one.surface : nullptr; };
    const auto verified =
        explainVerified(a->signature, surfaceOf(*a), b->signature, surfaceOf(*b), options, session.context());
    RETURN_IF_ERROR(verified);
    client::Comparison comparison;
    comparison.score = verified->score;
    comparison.signatureScore = verified->signatureScore;
    comparison.explanation = toClient(verified->explanation);
    if (verified->fit) comparison.fit = toClient(*verified->fit);
    comparison.verdict = verified->verdict;
    comparison.verdictReliability = reliabilityOf(verified->verdict);
    comparison.query = toClient(a->signature);
    comparison.other = toClient(b->signature);
    comparison.unit = flags.unit.value_or(LengthUnit::kNone);
    comparison.leftRightUntold = leftRightUntold(a->signature, options, verified->fit.has_value());
    return comparison;
}

/// Names of files were given where keys are meant.
Error withFilesHint(Error error, const CompareFlags& flags) {
    const auto isFile = [](const std::string& name) {
        std::error_code unknown;
        return std::filesystem::is_regular_file(name, unknown);
    };
    if (error.code == ErrorCode::kNotFound && isFile(flags.a) && isFile(flags.b)) {
        error.message += "; files are compared with --files";
    }
    return error;
}

Result<client::Comparison> compareStored(Session& session, const CompareFlags& flags) {
    if (flags.parameters.any()) {
        return fail(ErrorCode::kInvalidArgument,
                    "stored shapes use the parameters of their collection: these options need --files");
    }
    const auto client = connectToServer(session);
    RETURN_IF_ERROR(client);
    const RunContext context = session.context();
    const auto factor = factorToCollection(*client, flags.collection, flags.unit, context);
    RETURN_IF_ERROR(factor);
    auto comparison = client->compare({flags.collection, flags.a}, {flags.collection, flags.b},
                                      flags.score.forServer(), context);
    if (!comparison) return fail(withFilesHint(comparison.error(), flags));
    if (*factor != 1.0) scaleBy(1.0 / *factor, *comparison);
    return comparison;
}

CommandResult runCompare(Session& session, const CompareFlags& flags) {
    const auto comparison = flags.files ? compareFiles(session, flags) : compareStored(session, flags);
    RETURN_IF_ERROR(comparison);
    nlohmann::json document = {{"query_name", flags.a},
                               {"other_name", flags.b},
                               {"score", comparison->score},
                               {"signature_score", comparison->signatureScore},
                               {"explanation", toJson(comparison->explanation)},
                               {"query", toJson(comparison->query)},
                               {"other", toJson(comparison->other)},
                               {"verdict", verdictJson(comparison->verdict)},
                               {"verdict_reliability", comparison->verdictReliability},
                               {"mirrored", mirroredJson(fitsMirrored(comparison->fit))},
                               {"left_right_untold", comparison->leftRightUntold},
                               {"unit", unitJson(unitOfAnswer(flags.unit, comparison->unit))}};
    if (comparison->fit) document["fit"] = toJson(*comparison->fit);
    session.console().document(document);
    const std::string a = inLine(flags.files ? scanName(flags.a) : flags.a);
    const std::string b = inLine(flags.files ? scanName(flags.b) : flags.b);
    session.console().text(
        "score " + formatFixed(comparison->score, 3) + "  " + bar(comparison->score, 20) + "  " +
        likenessText(comparison->verdict, fitsMirrored(comparison->fit), a + " is part of " + b) + "\n" +
        (comparison->leftRightUntold ? kLeftRightUntold : "") + "\n" +
        explanationText(comparison->explanation, comparison->query, a, b) +
        (comparison->fit ? fitText(*comparison->fit, a, b) : "") + "\n" + a + "\n" +
        signatureTable(comparison->query) + "\n" + b + "\n" + signatureTable(comparison->other));
    return kOk;
}

}  // namespace

void addCompareCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<CompareFlags>();
    CLI::App* command =
        app.add_subcommand("compare", "Score two stored shapes, or two files with --files, and explain why");
    command->add_option("A", flags->a, "First key; with --files, first scan")->required();
    command->add_option("B", flags->b, "Second key; with --files, second scan")->required();
    command->add_flag("--files", flags->files, "A and B are scan files; needs no server");
    addCollectionOption(*command, flags->collection);
    addScoreFlags(*command, flags->score);
    addFreeScaleFlag(*command, flags->score);
    addUnitFlag(*command, flags->unit);
    addScanFlags(*command, flags->scan);
    addFormatFlag(*command, flags->scan);
    addParameterFlags(*command, flags->parameters);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runCompare(session, *flags); }; });
}

}  // namespace shapedb::cli
