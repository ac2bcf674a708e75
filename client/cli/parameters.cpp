// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/parameters.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <type_traits>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/cli/checks.h"
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

/// Calls visit(name in the API, member of client::Parameters, member of SegmentationOptions or
/// PreparationOptions, help) for each parameter that is a number.
template <typename Visitor>
void visitNumbers(Visitor&& visit) {
    using Given = client::Parameters;
    using Used = SegmentationOptions;
    using Prepared = PreparationOptions;
    visit("big_ball_ratio", &Given::bigBallRatio, &Used::bigBallRatio,
          "A Delaunay ball is big above this many point spacings (the paper's rho); above 0");
    visit("deep_angle_degrees", &Given::deepAngleDegrees, &Used::deepAngleDegrees,
          "Big balls intersect deeply below this angle; above 0 and below 90 degrees");
    visit("hull_angle_degrees", &Given::hullAngleDegrees, &Used::hullAngleDegrees,
          "The walk enters through hull facets below this angle; above 0 and below 90 degrees");
    visit("merge_ratio", &Given::mergeRatio, &Used::mergeRatio,
          "Merge segments whose maxima are both within this many radii of their shared triangle; 1 or more");
    visit("merge_contrast", &Given::mergeContrast, &Used::mergeContrast,
          "Merge by contrast instead: up to this ratio of radius to saddle, 1 or more; 0: use --merge-ratio");
    visit("min_segment_share", &Given::minSegmentShare, &Used::minSegmentShare,
          "With --merge-contrast: merge segments below this share of the volume; 0 to 1");
    visit("max_segments", &Given::maxSegments, &Used::maxSegments,
          "With --merge-contrast: keep merging while there are more; 0: no limit");
    visit("decimate_to", &Given::decimateTo, &Prepared::decimateTo,
          "Average denser scans onto a grid of about this many cells, 4 or more; 0: never");
    visit("outlier_ratio", &Given::outlierRatio, &Prepared::outlierRatio,
          "Drop points this many times further from others than their neighbours are, above 1; 0: keep all");
    visit("smoothing_reach", &Given::smoothingReach, &Prepared::smoothingReach,
          "Smooth noise over this many of its standard deviations, 1 to 20; 0: off");
    visit("thinning", &Given::thinning, &Prepared::thinning,
          "Thin points to this many times the distance that can be resolved, up to 10; 0: keep all");
}

/// The flag of a parameter: "outlier_ratio" -> "--outlier-ratio", angles without their unit.
std::string flagOf(std::string name) {
    const std::size_t unit = name.find("_degrees");
    if (unit != std::string::npos) name.erase(unit);
    std::replace(name.begin(), name.end(), '_', '-');
    return "--" + name;
}

/// Names of earlier versions, so that scripts keep working: flags are still read (not shown in the help),
/// JSON still has both.
struct FormerName {
    const char* name;
    const char* former;
};
constexpr std::array<FormerName, 2> kFormerNames = {
    {{"outlier_ratio", "stray_ratio"}, {"thinning", "even_spacing"}}};

const char* onOrOff(bool value) { return value ? "on" : "off"; }

std::string text(const char* value) { return value; }
std::string text(double value) { return formatNumber(value); }
std::string text(std::uint32_t value) { return std::to_string(value); }

/// " [2]", or " [2; paper 3]" if the profiles differ.
template <typename Value>
std::string defaults(Value standard, Value paper) {
    const std::string first = text(standard);
    const std::string second = text(paper);
    return " [" + first + (first == second ? "" : "; paper " + second) + "]";
}

void addNumberFlags(CLI::App& group, client::Parameters& given, const ShapeParameters& standard,
                    const ShapeParameters& paper) {
    visitNumbers([&](const std::string& name, auto member, auto used, const char* help) {
        auto* option = group.add_option(
            flagOf(name), given.*member,
            help + defaults(parameterIn(standard.segmentation, used), parameterIn(paper.segmentation, used)));
        for (const FormerName& one : kFormerNames) {
            if (name != one.name) continue;
            using Value = typename std::decay_t<decltype(given.*member)>::value_type;
            const std::string former = flagOf(one.former);
            const auto set = [&given, member, option, former](const Value& value) {
                // Option::excludes would appear in the help.
                if (option->count() > 0) throw CLI::ExcludesError(former, option->get_name());
                given.*member = value;
            };
            group.add_option_function<Value>(former, set)->group("");
        }
    });
}

}  // namespace

bool ParameterFlags::any() const {
    bool found = given.profile || given.interiorMethod || given.maxPoints || given.attributes ||
                 given.views || given.unit;
    visitNumbers(
        [&](const char*, auto member, auto, const char*) { found = found || (given.*member).has_value(); });
    return found;
}

Result<ShapeParameters> ParameterFlags::resolve() const {
    ShapeParameters parameters = parametersOf(given.profile.value_or(Profile::kDefault));
    visitNumbers([&](const char*, auto member, auto used, const char*) {
        if (given.*member) parameterIn(parameters.segmentation, used) = *(given.*member);
    });
    if (given.interiorMethod) parameters.segmentation.interiorMethod = *given.interiorMethod;
    if (given.maxPoints) parameters.signature.maxPoints = *given.maxPoints;
    if (given.attributes) parameters.signature.attributes = *given.attributes;
    if (given.views) parameters.views = *given.views;
    if (given.unit) parameters.unit = *given.unit;
    RETURN_IF_ERROR(validate(parameters));
    return parameters;
}

void addParameterFlags(CLI::App& command, ParameterFlags& flags) {
    const ShapeParameters standard = parametersOf(Profile::kDefault);
    const ShapeParameters paper = parametersOf(Profile::kPaper);
    client::Parameters& given = flags.given;
    const auto group = command.add_option_group("Method", "How a scan becomes segments and a signature");
    group
        ->add_option_function<std::string>(
            "--profile",
            [&given](const std::string& name) {
                given.profile = profileFromName(name).value_or(Profile::kDefault);
            },
            "Named set of parameters; the flags below override single values [default]")
        ->check(CLI::IsMember({profileName(Profile::kPaper), profileName(Profile::kDefault)}));
    addNumberFlags(*group, given, standard, paper);
    group
        ->add_option_function<std::string>(
            "--interior",
            [&given](const std::string& name) { given.interiorMethod = interiorMethodFromName(name); },
            "How to find the interior: the paper's walk, or adapted to the shape" +
                defaults(interiorMethodName(standard.segmentation.interiorMethod),
                         interiorMethodName(paper.segmentation.interiorMethod)))
        ->check(CLI::IsMember(
            {interiorMethodName(InteriorMethod::kWalk), interiorMethodName(InteriorMethod::kAdaptive)}));
    group->add_option("--max-points,--segments", given.maxPoints,
                      "Largest segments kept in the signature, 1 to " + std::to_string(kMaxSignaturePoints) +
                          defaults(standard.signature.maxPoints, paper.signature.maxPoints));
    group->add_flag_function(
        "--attributes,!--no-attributes", [&given](std::int64_t count) { given.attributes = count > 0; },
        "Also keep and score statistics of the whole shape" +
            defaults(onOrOff(standard.signature.attributes), onOrOff(paper.signature.attributes)));
    group->add_flag_function(
        "--views,!--no-views", [&given](std::int64_t count) { given.views = count > 0; },
        "Also keep views of the shape, so that scans of one side find it" +
            defaults(onOrOff(standard.views), onOrOff(paper.views)));
}

namespace {

std::vector<std::string> unitNames() {
    std::vector<std::string> names;
    for (const LengthUnit unit : kLengthUnits) names.emplace_back(lengthUnitName(unit));
    return names;
}

void addUnitOption(CLI::App& command, const char* flag, std::optional<LengthUnit>& unit, const char* help) {
    command
        .add_option_function<std::string>(
            flag, [&unit](const std::string& name) { unit = lengthUnitFromName(name); }, help)
        ->check(CLI::IsMember(unitNames()));
}

}  // namespace

void addUnitsFlag(CLI::App& command, ParameterFlags& flags) {
    addUnitOption(command, "--units", flags.given.unit,
                  "Unit of length of the scans: with one, sizes count in searches [none]");
}

void addUnitFlag(CLI::App& command, std::optional<LengthUnit>& unit) {
    addUnitOption(command, "--unit", unit,
                  "Unit of length of the files [that of the collection]; scans are converted");
}

void addFreeScaleFlag(CLI::App& command, ScoreFlags& flags) {
    command
        .add_flag("--free-scale", flags.freeScale, "Ignore sizes even if the collection has a unit of length")
        ->excludes(command.get_option("--keep-scale"));
}

ScoreOptions ScoreFlags::resolve() const {
    ScoreOptions options;
    options.reflection = !noReflection;
    options.keepScale = keepScale;
    options.partial = partial;
    return options;
}

void addScoreFlags(CLI::App& command, ScoreFlags& flags) {
    command.add_flag("--no-reflection", flags.noReflection, "Treat mirror images as different shapes");
    command.add_flag("--keep-scale", flags.keepScale, "Compare sizes too");
    command.add_flag("--partial", flags.partial,
                     "The query may be a one-sided scan or a broken piece: score how much of it the other "
                     "shape contains");
}

VerifyOptions VerifyFlags::options() const {
    VerifyOptions options;
    options.mostCandidates = candidates;
    options.oneSided = oneSided;
    if (viewpoint.size() == 3) options.viewpoint = Point3{viewpoint[0], viewpoint[1], viewpoint[2]};
    return options;
}

void addVerifyFlags(CLI::App& command, VerifyFlags& flags) {
    const auto set = [&flags](bool value) { return [&flags, value](std::int64_t) { flags.verify = value; }; };
    auto* on = command.add_flag(
        "--verify", set(true),
        "Lay the best candidates on the query and let the fit count in their scores (default, except with "
        "profile paper)");
    command.add_flag("--no-verify", set(false), "Rank by the signatures alone")->excludes(on);
    command
        .add_option("--candidates", flags.candidates,
                    "Verify at most this many candidates [32; open and incomplete queries 64; --partial 128]")
        ->check(CLI::Range(1, 10000));
    auto* allSides = command.add_flag_function(
        "--all-sides", [&flags](std::int64_t) { flags.oneSided = false; },
        "The query shows all sides of its object; by default judged from the points");
    command
        .add_flag_function(
            "--one-sided", [&flags](std::int64_t) { flags.oneSided = true; },
            "The query is what a camera saw from one place")
        ->excludes(allSides);
    command
        .add_option("--viewpoint", flags.viewpoint,
                    "Position of that camera: X,Y,Z in the coordinates of the query")
        ->delimiter(',')
        ->expected(3)
        ->excludes(allSides);
}

void addClusterFlags(CLI::App& command, ClusterFlags& flags) {
    command
        .add_option("--at-least", flags.atLeast,
                    "With several servers: the answer must include this change (add, get and delete print "
                    "its number with --json)")
        ->check(atLeastZero())
        ->type_name("N");
    command.add_flag("--allow-partial", flags.allowPartial,
                     "With several servers: answer without the parts of the collection that have no server");
}

std::string coveredText(double covered) {
    return "only " + formatPercent(covered) +
           " of the collection searched: servers that hold other parts of it are missing\n";
}

nlohmann::json toJson(const ShapeParameters& parameters) {
    client::Parameters all;
    visitNumbers([&](const char*, auto member, auto used, const char*) {
        all.*member = parameterIn(parameters.segmentation, used);
    });
    all.profile = parameters.profile;
    all.interiorMethod = parameters.segmentation.interiorMethod;
    all.maxPoints = parameters.signature.maxPoints;
    all.attributes = parameters.signature.attributes;
    all.views = parameters.views;
    all.unit = parameters.unit;
    return toJson(all);
}

nlohmann::json toJson(const client::Parameters& parameters) {
    nlohmann::json out = {
        {"profile", profileName(parameters.profile.value_or(Profile::kDefault))},
        {"interior_method", interiorMethodName(parameters.interiorMethod.value_or(InteriorMethod::kWalk))},
        {"max_points", parameters.maxPoints.value_or(0)},
        {"attributes", parameters.attributes.value_or(false)},
        {"views", parameters.views.value_or(false)},
        {"unit", lengthUnitName(parameters.unit.value_or(LengthUnit::kNone))}};
    visitNumbers([&](const char* name, auto member, auto, const char*) {
        out[name] = (parameters.*member).value_or(0);
    });
    for (const FormerName& one : kFormerNames) out[one.former] = out[one.name];
    return out;
}

}  // namespace shapedb::cli
