// SPDX-License-Identifier: GPL-3.0-or-later
// What core/ computes as messages of the API: the server sends them, and the `shapedb` command shows what it
// computed itself in the same form.
//
// Thread-safety: all functions may be called from any number of threads at once.
#pragma once

#include "common/wire_enums.h"
#include "common/wire_vector.h"
#include "core/fit/fit.h"
#include "core/geometry/point.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/segmentation/segmentation.h"
#include "core/signature/signature.h"
#include "shapedb/v1/search_service.pb.h"
#include "shapedb/v1/types.pb.h"

namespace shapedb::wire {

// Each fills an empty message.
void toProto(const Signature& signature, v1::Signature* out);
void toProto(const Segmentation& segmentation, v1::SegmentationReport* out);
void toProto(const Explanation& explanation, v1::Explanation* out);
void toProto(const FitResult& fit, v1::Fit* out);
/// Sets every field of both.
void toProto(const ShapeParameters& parameters, v1::SegmentationParameters* segmentation,
             v1::SignatureParameters* signature);

}  // namespace shapedb::wire
