// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/pipeline.h"

#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

// Denser scans add noise, not shape; docs/interior.md has the figures.
constexpr std::uint32_t kDefaultDecimation = 20000;

void recommend(ShapeParameters& parameters) {
    SegmentationOptions& segmentation = parameters.segmentation;
    segmentation.preparation.decimateTo = kDefaultDecimation;
    segmentation.preparation.outlierRatio = 3.0;
    segmentation.preparation.smoothingReach = 5.0;
    segmentation.preparation.thinning = 1.0;
    segmentation.interiorMethod = InteriorMethod::kAdaptive;
    segmentation.mergeContrast = 1.25;
    segmentation.minSegmentShare = 0.004;
    segmentation.maxSegments = 12;
    parameters.signature.maxPoints = 12;
    parameters.signature.attributes = true;
    parameters.views = true;
}

}  // namespace

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
        case Profile::kDefault: recommend(parameters); break;
    }
    return parameters;
}

Result<void> validate(const ShapeParameters& parameters) {
    RETURN_IF_ERROR(validate(parameters.segmentation));
    return validate(parameters.signature);
}

Result<Description> describe(const PointCloud& points, const ShapeParameters& parameters,
                             const RunContext& context) {
    RETURN_IF_ERROR(validate(parameters));
    auto segmentation = segment(points, parameters.segmentation, context);
    RETURN_IF_ERROR(segmentation);
    auto signature = makeSignature(*segmentation, parameters.signature, context);
    RETURN_IF_ERROR(signature);
    return Description{std::move(*segmentation), std::move(*signature)};
}

}  // namespace shapedb
