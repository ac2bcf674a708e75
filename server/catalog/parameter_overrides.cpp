// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/parameter_overrides.h"

#include "core/base/return_if_error.h"

namespace shapedb::catalog {
namespace {

template <typename Wanted, typename Value>
void overrideBy(const std::optional<Wanted>& wanted, Value& value) {
    if (wanted) value = *wanted;
}

}  // namespace

Result<ShapeParameters> ParameterOverrides::applyTo(const ShapeParameters& current) const {
    ShapeParameters parameters = profile ? parametersOf(*profile) : current;
    parameters.unit = unit.value_or(current.unit);
    SegmentationOptions& segmentation = parameters.segmentation;
    overrideBy(bigBallRatio, segmentation.bigBallRatio);
    overrideBy(deepAngleDegrees, segmentation.deepAngleDegrees);
    overrideBy(hullAngleDegrees, segmentation.hullAngleDegrees);
    overrideBy(mergeRatio, segmentation.mergeRatio);
    overrideBy(mergeContrast, segmentation.mergeContrast);
    overrideBy(minSegmentShare, segmentation.minSegmentShare);
    overrideBy(maxSegments, segmentation.maxSegments);
    overrideBy(decimateTo, segmentation.preparation.decimateTo);
    overrideBy(outlierRatio, segmentation.preparation.outlierRatio);
    overrideBy(smoothingReach, segmentation.preparation.smoothingReach);
    overrideBy(thinning, segmentation.preparation.thinning);
    overrideBy(interiorMethod, segmentation.interiorMethod);
    overrideBy(maxPoints, parameters.signature.maxPoints);
    overrideBy(attributes, parameters.signature.attributes);
    overrideBy(views, parameters.views);
    RETURN_IF_ERROR(validate(parameters));
    return parameters;
}

Result<ShapeParameters> ParameterOverrides::ofNew() const { return applyTo(parametersOf(Profile::kDefault)); }

}  // namespace shapedb::catalog
