// SPDX-License-Identifier: GPL-3.0-or-later
// The directory that holds the database and everything the server writes beside it.
#pragma once

#include <string>

#include "core/base/error.h"

namespace shapedb::files {

/// Name of the database in it.
constexpr const char* kDatabaseName = "shapedb.sqlite";
/// Name of the API keys in it.
constexpr const char* kKeysName = "keys.sqlite";

/// Creates the directory with its parents, readable by its owner only, or accepts one that is empty or holds
/// a ShapeDB database; an existing one keeps its permissions. Errors: kFileNotWritable (it cannot be created
/// or read, or holds something else: a slip such as `--data /var` must not make it ours).
[[nodiscard]] Result<void> prepareDataDirectory(const std::string& path);

/// Creates the directory for temporary files, private to its owner, and removes what a dead process left
/// in it: only files that TemporaryFile makes, never through a link. Errors: kFileNotWritable (it cannot
/// be created, is a link or belongs to another user).
[[nodiscard]] Result<void> prepareTemporaryDirectory(const std::string& path);

}  // namespace shapedb::files
