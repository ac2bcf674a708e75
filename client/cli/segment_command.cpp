// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb segment`: the parts and the signature of one scan, without a server.
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
#include "client/cli/console.h"
#include "client/cli/local_result.h"
#include "client/cli/parameters.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/shape_output.h"
#include "client/cli/text.h"
#include "client/io/ply_writer.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

struct SegmentFlags {
    std::string file;
    std::string out;
    ScanFlags scan;
    ParameterFlags parameters;
};

nlohmann::json segmentJson(const SegmentFlags& flags, const LoadedScan& scan,
                           const ShapeParameters& parameters, const client::SegmentationReport& report,
                           const client::Signature& signature) {
    nlohmann::json document = toJson(report);
    document["file"] = flags.file;
    document["format"] = scan.format;
    document["scene"] = sceneJson(*scan.scene, scan.pointsInScene, flags.scan.isolate);
    document["sampled_from_mesh"] = scan.sampledFromMesh;
    document["skipped_non_finite"] = scan.skippedNonFinite;
    document["ignored"] = scan.ignored;
    document["noise"] = flags.scan.noise;
    document["seed"] = flags.scan.seed;
    document["parameters"] = toJson(parameters);
    document["scale"] = signature.scale;
    document["signature"] = pointsJson(signature);
    if (signature.attributes) document["statistics"] = statisticsJson(signature);
    if (!flags.out.empty()) document["out"] = flags.out;
    return document;
}

std::string segmentText(const SegmentFlags& flags, const LoadedScan& scan, const ShapeParameters& parameters,
                        const client::SegmentationReport& report, const client::Signature& signature) {
    std::string text = inLine(scanName(flags.file)) + ": " + scan.format + ", " +
                       formatCount(report.points, "point", "points") +
                       (scan.sampledFromMesh ? " sampled from its surface" : "") + "\n";
    if (scan.skippedNonFinite > 0) {
        text += formatCount(scan.skippedNonFinite, "point", "points") + " without a measurement skipped\n";
    }
    for (const std::string& list : scan.ignored) text += "passed over: " + list + "\n";
    text += sceneText(*scan.scene, scan.pointsInScene, flags.scan.isolate);
    text += preparationText(report);
    text += formatCount(report.segments, "part", "parts") + ", volume " + formatNumber(report.volume) + "; " +
            formatCount(report.tetrahedra) + " tetrahedra, profile " + profileName(parameters.profile) +
            ", " + formatSeconds(report.totalSeconds) + " (Delaunay " +
            formatSeconds(report.delaunaySeconds) + ")\n";
    if (parameters.segmentation.interiorMethod == InteriorMethod::kAdaptive) {
        text += interiorText(report, signature.scale);
    }
    text += "\nLargest parts:\n" + signatureTable(signature);
    if (!flags.out.empty()) text += "\nPoints coloured by part: " + inLine(flags.out) + "\n";
    return text;
}

CommandResult runSegment(Session& session, const SegmentFlags& flags) {
    const auto parameters = flags.parameters.resolve();
    RETURN_IF_ERROR(parameters);
    const RunContext context = session.context();
    const auto scan = loadScan(flags.file, flags.scan, flags.scan.seed, context, true);
    RETURN_IF_ERROR(scan);
    const auto description = describe(scan->points, *parameters, context);
    if (!description) {
        return fail(description.error().code, scanName(flags.file) + ": " + description.error().message);
    }
    if (!flags.out.empty()) {
        const auto written =
            writeLabelledPly(flags.out, scan->points, description->segmentation.pointSegment);
        RETURN_IF_ERROR(written);
    }
    const client::SegmentationReport report = toClient(description->segmentation);
    const client::Signature signature = toClient(description->signature);
    session.console().document(segmentJson(flags, *scan, *parameters, report, signature));
    session.console().text(segmentText(flags, *scan, *parameters, report, signature));
    return kOk;
}

}  // namespace

void addSegmentCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<SegmentFlags>();
    CLI::App* command = app.add_subcommand("segment", "Cut one scan into its parts (needs no server)");
    command->add_option("FILE", flags->file, "Scan file, or - for standard input: " + scanFormatList())
        ->required();
    command->add_option("-o,--out", flags->out, "Write the points, coloured and labelled by part")
        ->type_name("FILE.ply")
        ->check(endsIn(".ply"));
    addScanFlags(*command, flags->scan);
    addFormatFlag(*command, flags->scan);
    addParameterFlags(*command, flags->parameters);
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runSegment(session, *flags); }; });
}

}  // namespace shapedb::cli
