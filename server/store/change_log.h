// SPDX-License-Identifier: GPL-3.0-or-later
// What servers that share a database tell each other through it: the log of changes of each collection.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace shapedb::store {

/// An entry of the log of a collection's changes (Store::changesAfter).
struct Change {
    std::int64_t number = 0;                ///< 1, 2, 3, ... in the order in which they were committed
    std::optional<std::int64_t> shapeId{};  ///< empty: more than one changed, load the collection again
};

/// How far the logs of a shared database go.
struct ChangeLogs {
    std::int64_t directory = 0;  ///< rises when collections or aliases come, go, or change their names
    std::map<std::int64_t, std::int64_t> last;  ///< the number of the last change, by collection
};

/// Where a collection of a shared database stands.
struct CollectionPosition {
    std::int64_t lastChange = 0;  ///< number of the last change; 0 where none are kept
    std::int64_t generation = 0;  ///< of the signatures that serve; 0: not told
};

}  // namespace shapedb::store
