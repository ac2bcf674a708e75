// Named sets of parameters: the method as published, and what we recommend.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/profile.h"
#include "core/segmentation/segmentation.h"
#include "core/signature/signature.h"

namespace shapedb {

/// Errors: kInvalidArgument listing the names.
[[nodiscard]] Result<Profile> profileFromName(const std::string& name);

/// Everything that decides what signature a scan gets.
struct ShapeParameters {
    Profile profile = Profile::kDefault;
    SegmentationOptions segmentation;
    SignatureOptions signature;
};

[[nodiscard]] ShapeParameters parametersOf(Profile profile);
[[nodiscard]] Result<void> validate(const ShapeParameters& parameters);

struct Description {
    Segmentation segmentation;
    Signature signature;
};

/// The whole road from points to signature. Errors: those of `segment`.
[[nodiscard]] Result<Description> describe(const PointCloud& points, const ShapeParameters& parameters,
                                           const RunContext& context = {});

}  // namespace shapedb
