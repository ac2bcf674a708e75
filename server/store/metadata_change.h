// SPDX-License-Identifier: GPL-3.0-or-later
// How a call changes the metadata of a shape, whichever database keeps them.
#pragma once

#include <string>
#include <vector>

#include "core/base/metadata.h"

namespace shapedb::store {

/// Made of nothing, it changes nothing.
struct MetadataChange {
    Metadata set;                     ///< in place of what the shape has under these keys
    std::vector<std::string> remove;  ///< keys; those the shape does not have are ignored
    bool replaceAll = false;          ///< the shape keeps only what `set` has

    /// What a shape that has `before` has afterwards.
    [[nodiscard]] Metadata of(const Metadata& before) const;
};

/// Afterwards a shape has exactly `metadata`.
[[nodiscard]] MetadataChange replacedBy(Metadata metadata);

}  // namespace shapedb::store
