// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/metadata_change.h"

#include <utility>

namespace shapedb::store {

Metadata MetadataChange::of(const Metadata& before) const {
    Metadata after = set;
    if (replaceAll) return after;
    after.insert(before.begin(), before.end());  // leaves what `set` has
    for (const std::string& key : remove) {
        if (set.count(key) == 0) after.erase(key);
    }
    return after;
}

MetadataChange replacedBy(Metadata metadata) { return {std::move(metadata), {}, true}; }

}  // namespace shapedb::store
