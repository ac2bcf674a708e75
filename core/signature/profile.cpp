#include "core/signature/profile.h"

#include <utility>

namespace shapedb {

namespace {

// Dense enough for 20,000-point detail twice over; a larger scan gains noise, not shape.
constexpr std::uint32_t kDefaultDecimation = 50000;

}  // namespace

const char* profileName(Profile profile) noexcept {
    switch (profile) {
        case Profile::kPaper: return "paper";
        case Profile::kDefault: return "default";
    }
    return "default";
}

Result<Profile> profileFromName(const std::string& name) {
    for (const Profile profile : {Profile::kPaper, Profile::kDefault}) {
        if (name == profileName(profile)) return profile;
    }
    return fail(ErrorCode::kInvalidArgument,
                "unknown profile '" + name + "'; the profiles are paper and default");
}

ShapeParameters parametersOf(Profile profile) {
    ShapeParameters parameters;
    parameters.profile = profile;
    switch (profile) {
        case Profile::kPaper: break;
        case Profile::kDefault: parameters.segmentation.decimateTo = kDefaultDecimation; break;
    }
    return parameters;
}

Result<void> validate(const ShapeParameters& parameters) {
    if (auto valid = validate(parameters.segmentation); !valid) return valid;
    return validate(parameters.signature);
}

Result<Description> describe(const PointCloud& points, const ShapeParameters& parameters,
                             const RunContext& context) {
    if (auto valid = validate(parameters); !valid) return fail(valid.error());
    auto segmentation = segment(points, parameters.segmentation, context);
    if (!segmentation) return fail(segmentation.error());
    auto signature = makeSignature(*segmentation, parameters.signature);
    if (!signature) return fail(signature.error());
    return Description{std::move(*segmentation), std::move(*signature)};
}

}  // namespace shapedb
