// SPDX-License-Identifier: Apache-2.0
// The beginning of an increment: what has changed from one backup to a later one. Its blocks follow
// (docs/backup-format.md has the bytes, which are persisted).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/backup_manifest.h"
#include "core/base/error.h"

namespace shapedb {

/// This many bytes tell how long the whole beginning is.
constexpr std::size_t kIncrementPrefixBytes = 104;

struct IncrementHead {
    BackupId base;                       ///< what it continues
    BackupManifest result;               ///< what comes of it
    std::vector<std::uint32_t> changed;  ///< blocks of `result` that it brings, ascending
};

/// Whether a file that begins so is meant to be an increment.
[[nodiscard]] bool looksLikeIncrement(const std::string& beginning);

[[nodiscard]] std::string encodeIncrementHead(const IncrementHead& head);

/// The size of all blocks that it brings.
[[nodiscard]] std::uint64_t changedBytes(const IncrementHead& head);

/// The size of the beginning, at most 2.4 MB, of an increment of `fileBytes` that begins with `prefix`.
/// Errors: kMalformedFile (says what is wrong).
[[nodiscard]] Result<std::size_t> incrementHeadBytes(const std::string& prefix, std::uint64_t fileBytes);

/// Reads a whole beginning, of the size above. What it returns has the right checksum, brings each block
/// whose size differs in base and result, and is exactly `fileBytes` long with its blocks; whether these are
/// whole tell only their hashes in `result`. Errors: kMalformedFile (says what is wrong).
[[nodiscard]] Result<IncrementHead> decodeIncrementHead(const std::string& head, std::uint64_t fileBytes);

}  // namespace shapedb
