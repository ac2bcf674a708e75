// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/grouping.h"

namespace shapedb {

GroupValue groupOf(const SignatureBlock& block, std::size_t row, const std::string& key) {
    const Metadata& metadata = block.metadata(row);
    const auto found = metadata.find(key);
    return found == metadata.end() ? nullptr : &found->second;
}

GroupValue groupOf(const SignatureSet& set, std::int64_t id, const std::string& key) {
    const SignatureSet::Place place = set.find(id);
    return groupOf(*place.block, place.row, key);
}

}  // namespace shapedb
