// SPDX-License-Identifier: GPL-3.0-or-later
// Searches whose right answer is known: every query is made of a shape of the gallery, with which it shares
// no point.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/fit/surface_points.h"
#include "core/geometry/point.h"
#include "core/search/signature_set.h"
#include "core/signature/signature.h"

namespace shapedb::bench {

/// How a query is made of a shape.
enum class Change { kRescan, kNoisy, kSparse, kOneSided, kPiece65, kPiece50, kBent, kTable };

struct ChangeInfo {
    Change change;
    const char* flag;         ///< for the command line
    const char* description;  ///< for tables
};
constexpr std::array<ChangeInfo, 8> kChanges{{
    {Change::kRescan, "rescan", "60 % of the points, 0.3 % noise"},
    {Change::kNoisy, "noisy", "1 % noise"},
    {Change::kSparse, "sparse", "3,000 points, 0.3 % noise"},
    {Change::kOneSided, "one-sided", "seen from one side"},
    {Change::kPiece65, "piece65", "65 % left"},
    {Change::kPiece50, "piece50", "50 % left"},
    {Change::kBent, "bent", "bent by 20 to 70 degrees"},
    {Change::kTable, "table", "on a table, which is dropped"},
}};
[[nodiscard]] const ChangeInfo& infoOf(Change change) noexcept;

struct LabelledModel {
    std::string label;
    PointCloud points;
};

/// The models in folders of class folders; without folders `members` of each synthetic family. Errors: those
/// of the readers, and kCancelled.
[[nodiscard]] Result<std::vector<LabelledModel>> labelledModels(const std::vector<std::string>& folders,
                                                                std::size_t members, std::uint64_t seed,
                                                                const RunContext& context);

/// A query of the model's second half (models.h), changed and turned at random. Noise is 0.3 % of the
/// diagonal unless the change has its own. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<PointCloud> makeQuery(const PointCloud& model, Change change, std::uint64_t seed,
                                           const RunContext& context);

struct DescribedModel {
    std::optional<Signature> signature;  ///< none: it could not be described
    std::shared_ptr<const SurfacePoints> surface;
    std::shared_ptr<const ShapeViews> views;  ///< of the gallery
};

/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<DescribedModel> describeModel(const PointCloud& points, bool withViews,
                                                   const RunContext& context);

/// First halves of the models, in their order; ids begin with 1.
struct Gallery {
    std::vector<DescribedModel> shapes;
    std::vector<IndexEntry> entries;  ///< of those that could be described
};

[[nodiscard]] Result<Gallery> describeGallery(const std::vector<LabelledModel>& models, unsigned threads,
                                              const RunContext& context);

}  // namespace shapedb::bench
