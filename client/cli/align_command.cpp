// `shapedb align`: lays one scan on another, without a server, or a stored shape on a scan.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/exit_code.h"
#include "client/cli/fit_output.h"
#include "client/cli/local_result.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "core/base/return_if_error.h"
#include "core/fit/fit.h"

namespace shapedb::cli {

namespace {

struct AlignFlags {
    std::string query;
    std::string other;
    bool keepScale = false;
    bool noReflection = false;
    bool partial = false;
    ScanFlags scan;

    [[nodiscard]] FitOptions resolve() const {
        FitOptions options;
        options.keepScale = keepScale;
        options.reflection = !noReflection;
        options.kinds.whole = !partial;
        return options;
    }
};

Result<SurfacePoints> surfaceOf(const std::string& path, const ScanFlags& flags, const RunContext& context) {
    const auto scan = loadScan(path, flags, flags.seed, context);
    RETURN_IF_ERROR(scan);
    auto surface = makeSurfacePoints(scan->points, context);
    if (!surface) return fail(surface.error().code, path + ": " + surface.error().message);
    return surface;
}

CommandResult runAlign(Session& session, const AlignFlags& flags) {
    const RunContext context = session.context();
    const auto query = surfaceOf(flags.query, flags.scan, context);
    RETURN_IF_ERROR(query);
    const auto other = surfaceOf(flags.other, flags.scan, context);
    RETURN_IF_ERROR(other);
    const auto found = fit(FitQuery(*query), *other, flags.resolve(), context);
    RETURN_IF_ERROR(found);
    const client::Fit shown = toClient(*found);
    nlohmann::json document = toJson(shown);
    document["query"] = flags.query;
    document["other"] = flags.other;
    session.console().document(document);
    session.console().text("score " + formatFixed(shown.best.score, 3) + "  " + bar(shown.best.score, 20) +
                           "\n\n" + fitMotionText(shown.best.motion, flags.other) +
                           fitText(shown, flags.query, flags.other));
    return kOk;
}

}  // namespace

void addAlignCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<AlignFlags>();
    CLI::App* command = app.add_subcommand(
        "align",
        "Lay one scan on another: the motion, how well they fit and which other poses fit as well "
        "(needs no server)");
    command->add_option("QUERY", flags->query, "Scan that stays where it is")->required();
    command->add_option("OTHER", flags->other, "Scan of a whole object that is laid on it")->required();
    command->add_flag("--keep-scale", flags->keepScale, "Both have the same unit of length: do not scale");
    command->add_flag("--no-reflection", flags->noReflection, "Do not mirror");
    command->add_flag("--partial", flags->partial, "QUERY shows one side or a piece, not all of the object");
    addScanFlags(*command, flags->scan);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runAlign(session, *flags); }; });
}

}  // namespace shapedb::cli
