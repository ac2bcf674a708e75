// SPDX-License-Identifier: GPL-3.0-or-later
// In what two servers differ, of which one is to become what the other is.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::cli {

/// Where the content comes from, and where it is to be. Both must outlive what is given this.
struct CopySides {
    const client::Client& from;
    const client::Client& to;
};

/// A key as either side has it; one of the two may be missing.
struct ShapePair {
    std::optional<client::Shape> from;
    std::optional<client::Shape> to;

    [[nodiscard]] const std::string& key() const { return from ? from->key : to->key; }
};

enum class ShapeDifference {
    kNone,
    kMissing,   ///< there
    kExtra,     ///< here there is none
    kPoints,    ///< other points, or the same elsewhere
    kMetadata,  ///< the same points
    kState,     ///< all else is the same
};

[[nodiscard]] ShapeDifference differenceOf(const ShapePair& pair);

/// "missing", "extra", "points", "metadata", "state"; "" for none.
[[nodiscard]] const char* differenceName(ShapeDifference difference) noexcept;

/// Calls `visit` with each key of a collection that both have, in ascending order. Which pages are read at
/// the same time is left to chance, so what is written meanwhile may look like a difference. Errors: those of
/// listShapes and `visit`.
[[nodiscard]] Result<void> visitPairs(const CopySides& sides, const std::string& collection,
                                      const std::function<Result<void>(ShapePair&&)>& visit,
                                      const RunContext& context);

/// The same for up to 1,000 shapes of one side: the other has these as they are. Errors: those of getShapes.
[[nodiscard]] Result<std::vector<ShapePair>> pairsOf(const CopySides& sides, const std::string& collection,
                                                     std::vector<client::Shape> from,
                                                     const RunContext& context);

/// What makes the collections of one server those of another.
struct CollectionStep {
    enum class Kind { kDeleteAlias, kRename, kDelete, kCreate, kRebuild, kSetAlias };
    Kind kind = Kind::kCreate;
    std::string name;                 ///< of the collection or alias, there
    std::string other{};              ///< the new name; of an alias, its collection
    client::Collection collection{};  ///< kCreate, kRebuild: as it is here
};

/// In the order in which they can be taken. `madeOf`: of collections there that were created for one here,
/// when that was created; others have been restored, and have the same time of creation.
[[nodiscard]] std::vector<CollectionStep> stepsBetween(
    const std::vector<client::Collection>& from, const std::vector<client::Collection>& to,
    const std::map<std::string, client::Timestamp>& madeOf = {});

/// What differs, in words: "collection cups is missing".
[[nodiscard]] std::string stepText(const CollectionStep& step);

}  // namespace shapedb::cli
