// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/search_run.h"

#include <CLI/CLI.hpp>

#include "client/cli/connection.h"
#include "client/cli/units.h"
#include "core/base/return_if_error.h"
#include "core/geometry/motion.h"

namespace shapedb::cli {

client::SearchOptions SearchFlags::resolve() const {
    client::SearchOptions resolved = options;
    resolved.reflection = !score.noReflection;
    resolved.keepScale = score.keepScale;
    resolved.freeScale = score.freeScale;
    resolved.partial = score.partial;
    resolved.verify = verify.verify;
    resolved.verifyCandidates = verify.candidates;
    const VerifyOptions verifyOptions = verify.options();
    resolved.oneSided = verifyOptions.oneSided;
    resolved.viewpoint = verifyOptions.viewpoint;
    return resolved;
}

void addSearchFlags(CLI::App& command, SearchFlags& flags) {
    command.add_flag("--include-self", flags.includeSelf, "With --key: keep the shape itself among the hits");
    addCollectionOption(command, flags.options.collection);
    command.add_option("-k,--k", flags.options.k, "Most hits to return")->capture_default_str();
    command.add_option("--threshold", flags.options.threshold, "Lowest score of a hit, 0 to 1");
    command.add_option("--filter", flags.options.filter, "Only shapes with such metadata, e.g. 'label=cup'");
    addScoreFlags(command, flags.score);
    addFreeScaleFlag(command, flags.score);
    addUnitFlag(command, flags.unit);
    addVerifyFlags(command, flags.verify);
    addScanFlags(command, flags.scan);
    addFormatFlag(command, flags.scan);
}

Result<Answer> Searcher::withFile(const std::string& path, const RunContext& context) const {
    auto scan = loadScan(path, flags.scan, flags.scan.seed, context, true);
    if (!scan) return fail(withKeyHint(scan.error(), path));
    Answer answer;
    answer.query = path;
    answer.points = scan->points;
    answer.scene = std::move(scan->scene);
    answer.pointsInScene = scan->pointsInScene;
    client::SearchOptions options = flags.resolve();
    if (factor != 1.0) {
        scaleBy(factor, scan->points);
        if (options.viewpoint) options.viewpoint = factor * *options.viewpoint;
    }
    auto reply = client.searchByScan(options, scan->points, context);
    if (!reply) return fail(withContext(reply.error(), scanName(path) + ": "));
    answer.reply = std::move(*reply);
    finish(answer);
    return answer;
}

Result<Answer> Searcher::withKey(const std::string& key, const RunContext& context) const {
    auto reply = client.searchByKey(flags.resolve(), key, flags.includeSelf, context);
    RETURN_IF_ERROR(reply);
    Answer answer;
    answer.query = key;
    answer.stored = true;
    answer.reply = std::move(*reply);
    finish(answer);
    return answer;
}

void Searcher::finish(Answer& answer) const {
    if (factor != 1.0) scaleBy(1.0 / factor, answer.reply);
    const LengthUnit unit = unitOfAnswer(flags.unit, answer.reply.unit);
    if (unit != LengthUnit::kNone) answer.unit = lengthUnitName(unit);
}

Result<PointCloud> Searcher::pointsOf(const Answer& answer, const RunContext& context) const {
    if (!answer.stored) return answer.points;
    auto stored = client.getPoints({flags.options.collection, answer.query}, context);
    RETURN_IF_ERROR(stored);
    if (factor != 1.0) scaleBy(1.0 / factor, stored->points);
    return std::move(stored->points);
}

Result<PointCloud> Searcher::pointsOf(const client::Hit& hit, const RunContext& context) const {
    const auto motion = motionOf(hit);
    if (!motion) {
        return fail(ErrorCode::kNotReady, hit.shape.key +
                                              ": how it lies on the query is not known: leave out "
                                              "--no-explanation, or add --verify");
    }
    auto stored = client.getPoints({hit.shape.collection, hit.shape.key}, context);
    RETURN_IF_ERROR(stored);
    if (factor != 1.0) scaleBy(1.0 / factor, stored->points);
    return applyToCloud(*motion, stored->points);
}

std::optional<Motion> motionOf(const client::Hit& hit) {
    if (hit.fit) return hit.fit->best.motion;
    if (hit.explanation) return hit.explanation->motion;
    return std::nullopt;
}

}  // namespace shapedb::cli
