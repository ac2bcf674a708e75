// SPDX-License-Identifier: GPL-3.0-or-later
// API keys in an SQLite file of their own.
#pragma once

#include <memory>
#include <string>

#include "core/base/error.h"
#include "server/security/key_store.h"

namespace shapedb::store {

/// Opens the file, or makes one that only its owner can read. Any number of processes may have it open.
/// Errors: kStorage, kStorageFull, kSchemaTooNew, kDataLoss (damaged, or not a file of keys).
[[nodiscard]] Result<std::unique_ptr<security::KeyStore>> openSqliteKeyStore(const std::string& path);

}  // namespace shapedb::store
