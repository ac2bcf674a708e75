// SPDX-License-Identifier: GPL-3.0-or-later
// Results that the command computes itself, in the form of a server reply, so that both print the same.
#pragma once

#include "client/api/types.h"

namespace shapedb {
struct Explanation;
struct FitResult;
struct Segmentation;
struct Signature;
}  // namespace shapedb

namespace shapedb::cli {

[[nodiscard]] client::Signature toClient(const Signature& signature);
[[nodiscard]] client::Explanation toClient(const Explanation& explanation);
[[nodiscard]] client::Fit toClient(const FitResult& fit);
[[nodiscard]] client::SegmentationReport toClient(const Segmentation& segmentation);

}  // namespace shapedb::cli
