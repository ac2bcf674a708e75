// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb align`: lays one scan on another, without a server, or a stored shape on a scan.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/connection.h"
#include "client/cli/console.h"
#include "client/cli/fit_output.h"
#include "client/cli/local_result.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "client/cli/units.h"
#include "client/io/output_file.h"
#include "client/io/ply_writer.h"
#include "core/base/return_if_error.h"
#include "core/fit/fit.h"

namespace shapedb::cli {

namespace {

struct AlignFlags {
    std::string query;
    std::string other;
    std::string key;
    std::string collection;
    std::string out;
    std::string matrix;
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

/// How the other lies on the query, and its points, where they were, if they are wanted.
struct Aligned {
    client::Alignment fit;
    PointCloud other;
};

Result<SurfacePoints> surfaceOf(const std::string& path, const PointCloud& points,
                                const RunContext& context) {
    auto surface = makeSurfacePoints(points, context);
    if (!surface) return fail(surface.error().code, scanName(path) + ": " + surface.error().message);
    return surface;
}

Result<Aligned> alignFiles(const AlignFlags& flags, const RunContext& context) {
    const auto sizesCount = sizesOfFilesCount(flags.unit, flags.score);
    RETURN_IF_ERROR(sizesCount);
    RETURN_IF_ERROR(checkReadOnce(flags.query, flags.other));
    const auto queryScan = loadScan(flags.query, flags.scan, flags.scan.seed, context);
    RETURN_IF_ERROR(queryScan);
    auto otherScan = loadScan(flags.other, flags.scan, flags.scan.seed, context);
    if (!otherScan) return fail(withKeyHint(otherScan.error(), flags.other));
    const auto query = surfaceOf(flags.query, queryScan->points, context);
    RETURN_IF_ERROR(query);
    const auto other = surfaceOf(flags.other, otherScan->points, context);
    RETURN_IF_ERROR(other);
    const auto found = align(FitQuery(*query), *other, flags.resolve(*sizesCount), context);
    RETURN_IF_ERROR(found);
    return Aligned{{toClient(*found), flags.unit.value_or(LengthUnit::kNone)}, std::move(otherScan->points)};
}

Result<Aligned> alignStored(const Session& session, const AlignFlags& flags, const RunContext& context) {
    auto scan = loadScan(flags.query, flags.scan, flags.scan.seed, context);
    RETURN_IF_ERROR(scan);
    const auto client = connectToServer(session, Work::kHeavy);
    RETURN_IF_ERROR(client);
    const auto factor = factorToCollection(*client, flags.collection, flags.unit, context);
    RETURN_IF_ERROR(factor);
    if (*factor != 1.0) scaleBy(*factor, scan->points);
    const client::ShapeRef shape{flags.collection, flags.key};
    auto found = client->align(scan->points, shape, flags.score.forServer(), context);
    RETURN_IF_ERROR(found);
    Aligned aligned{std::move(*found), {}};
    if (!flags.out.empty()) {
        auto stored = client->getPoints(shape, context);
        RETURN_IF_ERROR(stored);
        aligned.other = std::move(stored->points);
    }
    if (*factor != 1.0) {
        scaleBy(1.0 / *factor, aligned.fit);
        scaleBy(1.0 / *factor, aligned.other);
    }
    return aligned;
}

/// --out and --matrix. Moved coordinates have more digits than single precision.
Result<void> writeFiles(const AlignFlags& flags, const Aligned& aligned) {
    const Motion& motion = aligned.fit.best.motion;
    if (!flags.out.empty()) {
        RETURN_IF_ERROR(
            writePointsPly(flags.out, applyToCloud(motion, aligned.other), PlyPrecision::kDouble));
    }
    if (!flags.matrix.empty()) RETURN_IF_ERROR(writeTextFile(flags.matrix, matrixText(motion)));
    return {};
}

CommandResult runAlign(Session& session, const AlignFlags& flags) {
    if (flags.other.empty() == flags.key.empty()) {
        return fail(ErrorCode::kInvalidArgument, "give a second scan, or --key with a stored shape" +
                                                     std::string(flags.key.empty() ? "" : ", not both"));
    }
    const RunContext context = session.context();
    const auto aligned =
        flags.key.empty() ? alignFiles(flags, context) : alignStored(session, flags, context);
    RETURN_IF_ERROR(aligned);
    const client::Alignment& found = aligned->fit;
    RETURN_IF_ERROR(writeFiles(flags, *aligned));
    const std::string name = inLine(flags.key.empty() ? scanName(flags.other) : flags.key);
    const std::string query = inLine(scanName(flags.query));
    nlohmann::json document = toJson(found);
    document["query"] = flags.query;
    document["other"] = flags.key.empty() ? scanName(flags.other) : flags.key;
    document["unit"] = unitJson(unitOfAnswer(flags.unit, found.unit));
    if (!flags.out.empty()) document["out"] = flags.out;
    if (!flags.matrix.empty()) document["matrix_file"] = flags.matrix;
    std::string text = "score " + formatFixed(found.best.score, 3) + "  " + bar(found.best.score, 20) +
                       "\n\n" + fitMotionText(found.best.motion, name) + fitText(found, query, name) +
                       "\nMatrix, from coordinates of " + name + " to those of " + query + ":\n" +
                       matrixText(found.best.motion);
    if (!flags.out.empty()) text += "\n" + name + ", moved: " + inLine(flags.out) + "\n";
    session.console().document(document);
    session.console().text(text);
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
    command->add_option("OTHER", flags->other, "Scan of the whole object to align to QUERY");
    command->add_option("-o,--out", flags->out, "Write OTHER, moved onto QUERY, in double precision")
        ->type_name("FILE.ply")
        ->check(endsIn(".ply"));
    command->add_option("--matrix", flags->matrix, "Write the 4 x 4 matrix, four lines of four numbers")
        ->type_name("FILE");
    command->add_option("--key", flags->key, "Lay this stored shape on it instead")->check(notEmpty());
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
