// SPDX-License-Identifier: GPL-3.0-or-later
// Collections of which something that is stored cannot be read: what takes their place in the index, and what
// whoever asks for them is told.
#pragma once

#include <memory>

#include "server/index/collection_index.h"

namespace shapedb::index {

/// Its row cannot be read (store::Collection::damage): nothing but its id is known, and perhaps its name.
[[nodiscard]] std::shared_ptr<Snapshot> withoutRow(const store::Collection& collection);
/// Its parameters cannot be read; a rebuild with others makes it whole again.
[[nodiscard]] std::shared_ptr<Snapshot> withoutParameters(const store::Collection& collection,
                                                          const Error& why);
/// `empty`, of which the signatures cannot be read.
[[nodiscard]] std::shared_ptr<Snapshot> withoutSearches(const Snapshot& empty, const Error& why);

}  // namespace shapedb::index
