// SPDX-License-Identifier: GPL-3.0-or-later
// From points to signature: start reading here.
//
// A scan is prepared (core/preparation/), its interior found and divided into segments
// (core/segmentation/, Sections 2 and 3 of the paper), and the segments become a signature of weighted points
// (core/signature/, Section 4). Signatures are compared by core/matching/ and searched by core/search/.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/base/length_unit.h"
#include "core/base/run_context.h"
#include "core/profile.h"
#include "core/segmentation/segmentation.h"
#include "core/signature/signature.h"

namespace shapedb {

/// Errors: kInvalidArgument listing the names.
[[nodiscard]] Result<Profile> profileFromName(const std::string& name);

/// All parameters of what is made of a scan.
struct ShapeParameters {
    Profile profile = Profile::kDefault;
    SegmentationOptions segmentation;
    SignatureOptions signature;
    /// Whether a collection keeps views of its shapes (core/views/views.h), so that queries of one side find
    /// them.
    bool views = false;
    /// The unit of the scans of a collection. If there is one, sizes count in searches unless those say
    /// otherwise.
    LengthUnit unit = LengthUnit::kNone;
};

[[nodiscard]] ShapeParameters parametersOf(Profile profile);
/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const ShapeParameters& parameters);

struct Description {
    Segmentation segmentation;
    Signature signature;
};

/// Points to segmentation and signature. Deterministic. Errors: those of `validate`, `segment` and
/// `makeSignature`.
[[nodiscard]] Result<Description> describe(const PointCloud& points, const ShapeParameters& parameters,
                                           const RunContext& context = {});

}  // namespace shapedb
