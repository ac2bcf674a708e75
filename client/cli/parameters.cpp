#include "client/cli/parameters.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/text.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace {

/// The parameter that a member pointer names, in SegmentationOptions or the PreparationOptions within.
template <typename Options, typename Value>
auto& parameterIn(Options& options, Value SegmentationOptions::*member) {
    return options.*member;
}
template <typename Options, typename Value>
auto& parameterIn(Options& options, Value PreparationOptions::*member) {
    return options.preparation.*member;
}

/// Calls visit(flag, name, member of client::Parameters, member of SegmentationOptions or
/// PreparationOptions, help) for each parameter that is a number.
template <typename Visitor>
void visitNumbers(Visitor&& visit) {
    using Given = client::Parameters;
    using Used = SegmentationOptions;
    visit("--big-ball-ratio", "big_ball_ratio", &Given::bigBallRatio, &Used::bigBallRatio,
          "A Delaunay ball is big above this many point spacings (rho), above 0");
    visit("--deep-angle", "deep_angle_degrees", &Given::deepAngleDegrees, &Used::deepAngleDegrees,
          "Big balls intersect deeply below this angle, above 0 and below 90 degrees");
    visit("--hull-angle", "hull_angle_degrees", &Given::hullAngleDegrees, &Used::hullAngleDegrees,
          "The walk enters through hull facets below this angle, above 0 and below 90 degrees");
    visit("--merge-ratio", "merge_ratio", &Given::mergeRatio, &Used::mergeRatio,
          "Segments merge when both maxima are within this many radii of their triangle, 1 or more");
    visit("--merge-contrast", "merge_contrast", &Given::mergeContrast, &Used::mergeContrast,
          "Segments merge by contrast instead, up to this ratio of radius to saddle, 1 or more; 0: by "
          "--merge-ratio");
    visit("--min-segment-share", "min_segment_share", &Given::minSegmentShare, &Used::minSegmentShare,
          "With --merge-contrast: lighter segments join a neighbour, share of the volume, 0 to 1");
    visit("--max-segments", "max_segments", &Given::maxSegments, &Used::maxSegments,
          "With --merge-contrast: merge on while there are more; 0: no limit");
    visit("--decimate-to", "decimate_to", &Given::decimateTo, &PreparationOptions::decimateTo,
          "Average denser scans onto a grid of about this many cells, 4 or more; 0: never");
    visit("--outlier-ratio,--stray-ratio", "outlier_ratio", &Given::outlierRatio,
          &PreparationOptions::outlierRatio,
          "Leave out points this many times further from others than their neighbours are, above 1; 0: none");
    visit("--smoothing-reach", "smoothing_reach", &Given::smoothingReach, &PreparationOptions::smoothingReach,
          "Smooth noise out to this many of its standard deviations, 1 to 20; 0: no smoothing");
    visit("--thinning,--even-spacing", "thinning", &Given::thinning, &PreparationOptions::thinning,
          "Thin points to this many times the distance that tells them apart, up to 10; 0: keep all");
}

const char* nameOf(InteriorMethod method) { return method == InteriorMethod::kWalk ? "walk" : "adaptive"; }

const char* nameOf(client::InteriorMethod method) {
    return method == client::InteriorMethod::kWalk ? "walk" : "adaptive";
}

const char* onOrOff(bool value) { return value ? "on" : "off"; }

std::string text(const char* value) { return value; }
std::string text(double value) { return formatNumber(value); }
std::string text(std::uint32_t value) { return std::to_string(value); }

/// " [2]", or " [2; paper 3]" when the profiles differ.
template <typename Value>
std::string defaults(Value standard, Value paper) {
    const std::string first = text(standard);
    const std::string second = text(paper);
    return " [" + first + (first == second ? "" : "; paper " + second) + "]";
}

}  // namespace

Result<ShapeParameters> ParameterFlags::resolve() const {
    ShapeParameters parameters = parametersOf(Profile::kDefault);
    if (profile) {
        const auto named = profileFromName(*profile);
        RETURN_IF_ERROR(named);
        parameters = parametersOf(*named);
    }
    visitNumbers([&](const char*, const char*, auto given, auto used, const char*) {
        if (numbers.*given) parameterIn(parameters.segmentation, used) = *(numbers.*given);
    });
    if (interior) {
        parameters.segmentation.interiorMethod =
            *interior == "walk" ? InteriorMethod::kWalk : InteriorMethod::kAdaptive;
    }
    if (numbers.maxPoints) parameters.signature.maxPoints = *numbers.maxPoints;
    if (numbers.attributes) parameters.signature.attributes = *numbers.attributes;
    RETURN_IF_ERROR(validate(parameters));
    return parameters;
}

client::Parameters ParameterFlags::forServer() const {
    client::Parameters parameters = numbers;
    if (profile) {
        parameters.profile = *profile == "paper" ? client::Profile::kPaper : client::Profile::kDefault;
    }
    if (interior) {
        parameters.interiorMethod =
            *interior == "walk" ? client::InteriorMethod::kWalk : client::InteriorMethod::kAdaptive;
    }
    return parameters;
}

bool ParameterFlags::any() const {
    bool given = profile || interior || numbers.maxPoints || numbers.attributes;
    visitNumbers([&](const char*, const char*, auto member, auto, const char*) {
        given = given || (numbers.*member).has_value();
    });
    return given;
}

void addParameterFlags(CLI::App& command, ParameterFlags& flags) {
    const ShapeParameters standard = parametersOf(Profile::kDefault);
    const ShapeParameters paper = parametersOf(Profile::kPaper);
    const auto group = command.add_option_group("Method", "How a scan becomes segments and a signature");
    group->add_option("--profile", flags.profile, "Named set of parameters [default]")
        ->check(CLI::IsMember({"paper", "default"}));
    visitNumbers([&](const char* flag, const char*, auto given, auto used, const char* help) {
        group->add_option(
            flag, flags.numbers.*given,
            help + defaults(parameterIn(standard.segmentation, used), parameterIn(paper.segmentation, used)));
    });
    group
        ->add_option("--interior", flags.interior,
                     "How the interior is found: the paper's walk, or decided from the shape itself" +
                         defaults(nameOf(standard.segmentation.interiorMethod),
                                  nameOf(paper.segmentation.interiorMethod)))
        ->check(CLI::IsMember({"walk", "adaptive"}));
    group->add_option("--max-points,--segments", flags.numbers.maxPoints,
                      "Heaviest segments kept in the signature, 1 to " + std::to_string(kMaxSignaturePoints) +
                          defaults(standard.signature.maxPoints, paper.signature.maxPoints));
    group->add_flag_function(
        "--attributes,!--no-attributes",
        [&flags](std::int64_t count) { flags.numbers.attributes = count > 0; },
        "Keep and score what the shape says as a whole, or points and weights alone" +
            defaults(onOrOff(standard.signature.attributes), onOrOff(paper.signature.attributes)));
}

ScoreOptions ScoreFlags::resolve() const {
    ScoreOptions options;
    options.reflection = !noReflection;
    options.keepScale = keepScale;
    options.partial = partial;
    return options;
}

void addScoreFlags(CLI::App& command, ScoreFlags& flags) {
    command.add_flag("--no-reflection", flags.noReflection, "Tell left from right: no mirrored alignments");
    command.add_flag("--keep-scale", flags.keepScale,
                     "Compare sizes too: shapes are not scaled to each other");
    command.add_flag(
        "--partial", flags.partial,
        "The query may be a one-sided scan or a broken piece: score how much of it is in the other");
}

nlohmann::json toJson(const ShapeParameters& parameters) {
    nlohmann::json out = {{"profile", profileName(parameters.profile)},
                          {"interior_method", nameOf(parameters.segmentation.interiorMethod)},
                          {"max_points", parameters.signature.maxPoints},
                          {"attributes", parameters.signature.attributes}};
    visitNumbers([&](const char*, const char* name, auto, auto used, const char*) {
        out[name] = parameterIn(parameters.segmentation, used);
    });
    return out;
}

nlohmann::json toJson(const client::Parameters& parameters) {
    nlohmann::json out = {
        {"profile", parameters.profile == client::Profile::kPaper ? "paper" : "default"},
        {"interior_method", nameOf(parameters.interiorMethod.value_or(client::InteriorMethod::kWalk))},
        {"max_points", parameters.maxPoints.value_or(0)},
        {"attributes", parameters.attributes.value_or(false)}};
    visitNumbers([&](const char*, const char* name, auto given, auto, const char*) {
        out[name] = (parameters.*given).value_or(0);
    });
    return out;
}

}  // namespace shapedb::cli
