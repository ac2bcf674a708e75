// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/parameters_codec.h"

#include <cstdint>
#include <exception>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

namespace shapedb::store {
namespace {

using Json = nlohmann::ordered_json;

/// Reads the members of one object and finds those that are not parameters.
class ObjectReader {
  public:
    ObjectReader(const Json& object, std::string prefix) : object_(object), prefix_(std::move(prefix)) {
        if (!object_.is_object()) note("is not an object", "");
    }

    void read(const char* name, double& value) {
        if (const Json* member = find(name)) {
            if (member->is_number()) {
                value = member->get<double>();
            } else {
                note("is not a number", name);
            }
        }
    }

    void read(const char* name, std::uint32_t& value) {
        if (const Json* member = find(name)) {
            if (member->is_number_unsigned() &&
                member->get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max()) {
                value = member->get<std::uint32_t>();
            } else {
                note("is not a whole number of 32 bits", name);
            }
        }
    }

    void read(const char* name, bool& value) {
        if (const Json* member = find(name)) {
            if (member->is_boolean()) {
                value = member->get<bool>();
            } else {
                note("is neither true nor false", name);
            }
        }
    }

    void read(const char* name, std::string& value) {
        if (const Json* member = find(name)) {
            if (member->is_string()) {
                value = member->get<std::string>();
            } else {
                note("is not text", name);
            }
        }
    }

    /// Null when absent.
    const Json* find(const char* name) {
        known_.insert(name);
        if (!object_.is_object()) return nullptr;
        const auto found = object_.find(name);
        return found == object_.end() ? nullptr : &*found;
    }

    /// The first thing wrong, or empty.
    std::string problem() {
        if (problem_.empty() && object_.is_object()) {
            for (const auto& item : object_.items()) {
                if (known_.count(item.key()) == 0) note("is not a known parameter", item.key());
            }
        }
        return problem_;
    }

  private:
    void note(const std::string& what, const std::string& name) {
        if (problem_.empty()) problem_ = "'" + prefix_ + name + "' " + what;
    }

    const Json& object_;
    std::string prefix_;
    std::set<std::string> known_;
    std::string problem_;
};

tl::unexpected<Error> damagedParameters(const std::string& what) {
    return fail(ErrorCode::kDataLoss, "stored collection parameters: " + what);
}

/// Refuses repeated keys, of which the library would silently keep the last.
Json parseStrictly(const std::string& text) {
    std::vector<std::set<std::string>> open;
    return Json::parse(text, [&](int, Json::parse_event_t event, Json& parsed) {
        if (event == Json::parse_event_t::object_start) open.emplace_back();
        if (event == Json::parse_event_t::object_end) open.pop_back();
        if (event == Json::parse_event_t::key && !open.back().insert(parsed.get<std::string>()).second) {
            throw std::invalid_argument("'" + parsed.get<std::string>() + "' is given twice");
        }
        return true;
    });
}

Result<void> readSegmentation(const Json& json, SegmentationOptions& options) {
    ObjectReader reader(json, "segmentation.");
    reader.read("big_ball_ratio", options.bigBallRatio);
    reader.read("deep_angle_degrees", options.deepAngleDegrees);
    reader.read("hull_angle_degrees", options.hullAngleDegrees);
    reader.read("merge_ratio", options.mergeRatio);
    reader.read("decimate_to", options.preparation.decimateTo);
    reader.read("merge_contrast", options.mergeContrast);
    reader.read("min_segment_share", options.minSegmentShare);
    reader.read("max_segments", options.maxSegments);
    reader.read("stray_ratio", options.preparation.outlierRatio);
    reader.read("smoothing_reach", options.preparation.smoothingReach);
    reader.read("even_spacing", options.preparation.thinning);
    std::string method = interiorMethodName(options.interiorMethod);
    reader.read("interior_method", method);
    if (const std::string problem = reader.problem(); !problem.empty()) return damagedParameters(problem);
    const auto known = interiorMethodFromName(method);
    if (!known) return damagedParameters("'segmentation.interior_method' is '" + method + "'");
    options.interiorMethod = *known;
    return {};
}

}  // namespace

std::string encodeParameters(const ShapeParameters& parameters) {
    const SegmentationOptions& segmentation = parameters.segmentation;
    Json json;
    json["profile"] = profileName(parameters.profile);
    json["segmentation"] = {{"big_ball_ratio", segmentation.bigBallRatio},
                            {"deep_angle_degrees", segmentation.deepAngleDegrees},
                            {"hull_angle_degrees", segmentation.hullAngleDegrees},
                            {"merge_ratio", segmentation.mergeRatio},
                            {"decimate_to", segmentation.preparation.decimateTo},
                            {"merge_contrast", segmentation.mergeContrast},
                            {"min_segment_share", segmentation.minSegmentShare},
                            {"max_segments", segmentation.maxSegments},
                            {"stray_ratio", segmentation.preparation.outlierRatio},
                            {"smoothing_reach", segmentation.preparation.smoothingReach},
                            {"even_spacing", segmentation.preparation.thinning},
                            {"interior_method", interiorMethodName(segmentation.interiorMethod)}};
    json["signature"] = {{"max_points", parameters.signature.maxPoints},
                         {"attributes", parameters.signature.attributes}};
    json["views"] = parameters.views;
    json["unit"] = lengthUnitName(parameters.unit);
    return json.dump();
}

Result<ShapeParameters> decodeParameters(const std::string& text) {
    try {
        const Json json = parseStrictly(text);
        ObjectReader top(json, "");
        std::string name;
        top.read("profile", name);
        const Json empty = Json::object();
        const Json* segmentationJson = top.find("segmentation");
        const Json* signatureJson = top.find("signature");
        std::optional<bool> views;
        if (top.find("views") != nullptr) top.read("views", views.emplace());
        std::string unit = lengthUnitName(LengthUnit::kNone);
        top.read("unit", unit);
        if (const std::string problem = top.problem(); !problem.empty()) return damagedParameters(problem);

        const Result<Profile> profile = profileFromName(name);
        if (!profile) return damagedParameters(profile.error().message);
        ShapeParameters parameters = parametersOf(Profile::kPaper);
        parameters.profile = *profile;
        // Collections from before there were views get them with their next rebuild.
        parameters.views = views.value_or(parametersOf(*profile).views);
        const auto knownUnit = lengthUnitFromName(unit);
        if (!knownUnit) return damagedParameters("'unit' is '" + unit + "'");
        parameters.unit = *knownUnit;
        if (const auto read = readSegmentation(segmentationJson != nullptr ? *segmentationJson : empty,
                                               parameters.segmentation);
            !read) {
            return fail(read.error());
        }

        ObjectReader signature(signatureJson != nullptr ? *signatureJson : empty, "signature.");
        signature.read("max_points", parameters.signature.maxPoints);
        signature.read("attributes", parameters.signature.attributes);
        if (const std::string problem = signature.problem(); !problem.empty())
            return damagedParameters(problem);

        if (const Result<void> valid = validate(parameters); !valid)
            return damagedParameters(valid.error().message);
        return parameters;
    } catch (const std::exception& error) {
        return damagedParameters(error.what());
    }
}

bool sameProfile(const std::string& a, const std::string& b) {
    if (a == b) return true;
    const auto first = decodeParameters(a);
    const auto second = decodeParameters(b);
    return first && second && first->profile == second->profile &&
           first->signature.attributes == second->signature.attributes;
}

}  // namespace shapedb::store
