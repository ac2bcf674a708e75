// SPDX-License-Identifier: GPL-3.0-or-later
// The parameters of Store::importCollection.
#pragma once

#include <functional>
#include <string>

#include "core/base/error.h"

namespace shapedb::store {

struct Collection;
struct Shape;

/// The functions may be null; an error that one returns ends the import. None is called in a transaction.
struct ImportRequest {
    std::string name{};  ///< of the collection once it is there; empty: the one in the file
    /// Asked about the collection, under its new name, before anything is stored; its id is 0.
    std::function<Result<void>(const Collection&)> accept{};
    /// Asked about each shape, as it is in the file, before it is stored.
    std::function<Result<void>(const Shape&)> acceptShape{};
    /// Called once all is stored, before the collection is seen and its jobs are queued. Until this returns,
    /// nobody else changes the collection; its id and those of its shapes are final.
    std::function<Result<void>(const Collection&)> beforeVisible{};
};

}  // namespace shapedb::store
