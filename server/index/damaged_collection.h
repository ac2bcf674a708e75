// SPDX-License-Identifier: GPL-3.0-or-later
// Collections whose stored data cannot be read in full: what stands for them in the index, and the error
// that their callers get.
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
