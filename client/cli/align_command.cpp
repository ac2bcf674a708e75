// `shapedb align`: lays one scan on another, without a server, or a stored shape on a scan.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/fit_output.h"
#include "client/cli/local_result.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "core/base/return_if_error.h"
#include "core/fit/fit.h"

namespace shapedb::cli {

namespace {

struct AlignFlags {
    std::string query;
    std::string other;
    std::string key;
    std::string collection;
    ScoreFlags score;
    std::optional<LengthUnit> unit;
    ScanFlags scan;

    [[nodiscard]] FitOptions resolve(bool keepScale) const {
        FitOptions options;
        options.keepScale = keepScale;
        options.reflection = !score.noReflection;
        options.kinds.whole = !score.partial;
        return options;
    }
};

Result<SurfacePoints> surfaceOf(const std::string& path, const ScanFlags& flags, const RunContext& context) {
    const auto scan = loadScan(path, flags, flags.seed, context);
    RETURN_IF_ERROR(scan);
    auto surface = makeSurfacePoints(scan->points, context);
    if (!surface) return fail(surface.error().code, scanName(path) + ": " + surface.error().message);
    return surface;
}

Result<client::Alignment> alignFiles(const AlignFlags& flags, const RunContext& context) {
    const auto sizesCount = sizesOfFilesCount(flags.unit, flags.score);
    RETURN_IF_ERROR(sizesCount);
    RETURN_IF_ERROR(checkReadOnce(flags.query, flags.other));
    const auto query = surfaceOf(flags.query, flags.scan, context);
    RETURN_IF_ERROR(query);
    const auto other = surfaceOf(flags.other, flags.scan, context);
    RETURN_IF_ERROR(other);
    const auto found = align(FitQuery(*query), *other, flags.resolve(*sizesCount), context);
    RETURN_IF_ERROR(found);
    return client::Alignment{toClient(*found), flags.unit.value_or(LengthUnit::kNone)};
}

Result<client::Alignment> alignStored(const Session& session, const AlignFlags& flags,
                                      const RunContext& context) {
    auto scan = loadScan(flags.query, flags.scan, flags.scan.seed, context);
    RETURN_IF_ERROR(scan);
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto factor = factorToCollection(*client, flags.collection, flags.unit, context);
    RETURN_IF_ERROR(factor);
    if (*factor != 1.0) scaleBy(*factor, scan->points);
    auto found = client->align(scan->points, client::ShapeRef{flags.collection, flags.key},
                               flags.score.forServer(), context);
    RETURN_IF_ERROR(found);
    if (*factor != 1.0) scaleBy(1.0 / *factor, *found);
    return found;
}

CommandResult runAlign(Session& session, const AlignFlags& flags) {
    if (flags.other.empty() == flags.key.empty()) {
        return fail(ErrorCode::kInvalidArgument, "give a second scan, or --key with a stored shape" +
                                                     std::string(flags.key.empty() ? "" : ", not both"));
    }
    const RunContext context = session.context();
    const auto found = flags.key.empty() ? alignFiles(flags, context) : alignStored(session, flags, context);
    RETURN_IF_ERROR(found);
    const std::string name = flags.key.empty() ? scanName(flags.other) : flags.key;
    nlohmann::json document = toJson(*found);
    document["query"] = flags.query;
    document["other"] = name;
    document["unit"] = unitJson(unitOfAnswer(flags.unit, found->unit));
    session.console().document(document);
    session.console().text("score " + formatFixed(found->best.score, 3) + "  " + bar(found->best.score, 20) +
                           "\n\n" + fitMotionText(found->best.motion, name) +
                           fitText(*found, scanName(flags.query), name));
    return kOk;
}

}  // namespace

void addAlignCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<AlignFlags>();
    CLI::App* command = app.add_subcommand(
        "align",
        "Lay a scan or a stored shape on a scan: the motion, how well they fit and which other poses fit as "
        "well (two files need no server)");
    command->add_option("QUERY", flags->query, "Scan that stays where it is")->required();
    command->add_option("OTHER", flags->other, "Scan of a whole object that is laid on it");
    command->add_option("--key", flags->key, "Lay this stored shape on it instead");
    addCollectionOption(*command, flags->collection);
    command->add_flag("--keep-scale", flags->score.keepScale,
                      "Both have the same unit of length: do not scale");
    command->add_flag("--no-reflection", flags->score.noReflection, "Do not mirror");
    command->add_flag("--partial", flags->score.partial,
                      "QUERY shows one side or a piece, not all of the object");
    addUnitFlag(*command, flags->unit);
    addFreeScaleFlag(*command, flags->score);
    addScanFlags(*command, flags->scan);
    addFormatFlag(*command, flags->scan);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runAlign(session, *flags); }; });
}

}  // namespace shapedb::cli
