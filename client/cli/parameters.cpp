#include "client/cli/parameters.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace shapedb::cli {

namespace {

template <typename T>
void overrideWith(T& value, const std::optional<T>& given) {
    if (given) value = *given;
}

}  // namespace

Result<ShapeParameters> ParameterFlags::resolve() const {
    ShapeParameters parameters = parametersOf(Profile::kDefault);
    if (profile) {
        const auto named = profileFromName(*profile);
        if (!named) return fail(named.error());
        parameters = parametersOf(*named);
    }
    overrideWith(parameters.segmentation.bigBallRatio, bigBallRatio);
    overrideWith(parameters.segmentation.deepAngleDegrees, deepAngle);
    overrideWith(parameters.segmentation.hullAngleDegrees, hullAngle);
    overrideWith(parameters.segmentation.mergeRatio, mergeRatio);
    overrideWith(parameters.segmentation.decimateTo, decimateTo);
    overrideWith(parameters.signature.maxPoints, maxPoints);
    if (const auto valid = validate(parameters); !valid) return fail(valid.error());
    return parameters;
}

client::Parameters ParameterFlags::forServer() const {
    client::Parameters parameters;
    if (profile)
        parameters.profile = *profile == "paper" ? client::Profile::kPaper : client::Profile::kDefault;
    parameters.bigBallRatio = bigBallRatio;
    parameters.deepAngleDegrees = deepAngle;
    parameters.hullAngleDegrees = hullAngle;
    parameters.mergeRatio = mergeRatio;
    parameters.decimateTo = decimateTo;
    parameters.maxPoints = maxPoints;
    return parameters;
}

bool ParameterFlags::any() const {
    return profile || bigBallRatio || deepAngle || hullAngle || mergeRatio || decimateTo || maxPoints;
}

void addParameterFlags(CLI::App& command, ParameterFlags& flags) {
    const auto group = command.add_option_group("Method", "How a scan becomes segments and a signature");
    group->add_option("--profile", flags.profile, "Named set of parameters [default]")
        ->check(CLI::IsMember({"paper", "default"}));
    group->add_option("--big-ball-ratio", flags.bigBallRatio,
                      "A Delaunay ball is big above this many point spacings (rho) [0.5]");
    group->add_option("--deep-angle", flags.deepAngle,
                      "Big balls intersect deeply below this angle, degrees [20]");
    group->add_option("--hull-angle", flags.hullAngle,
                      "The walk enters through hull facets below this angle, degrees [5]");
    group->add_option("--merge-ratio", flags.mergeRatio,
                      "Segments merge when both peaks are within this many radii of their triangle [1.5]");
    group->add_option("--decimate-to", flags.decimateTo,
                      "Average denser scans onto a grid of about this many cells; 0: never");
    group->add_option("--max-points,--segments", flags.maxPoints,
                      "Heaviest segments kept in the signature, 1 to 16 [7]");
}

ScoreOptions ScoreFlags::resolve() const {
    ScoreOptions options;
    options.reflection = !noReflection;
    options.keepScale = keepScale;
    return options;
}

void addScoreFlags(CLI::App& command, ScoreFlags& flags) {
    command.add_flag("--no-reflection", flags.noReflection, "Tell left from right: no mirrored alignments");
    command.add_flag("--keep-scale", flags.keepScale,
                     "Compare sizes too: shapes are not scaled to each other");
}

nlohmann::json toJson(const ShapeParameters& parameters) {
    return {{"profile", profileName(parameters.profile)},
            {"big_ball_ratio", parameters.segmentation.bigBallRatio},
            {"deep_angle_degrees", parameters.segmentation.deepAngleDegrees},
            {"hull_angle_degrees", parameters.segmentation.hullAngleDegrees},
            {"merge_ratio", parameters.segmentation.mergeRatio},
            {"decimate_to", parameters.segmentation.decimateTo},
            {"max_points", parameters.signature.maxPoints}};
}

}  // namespace shapedb::cli
