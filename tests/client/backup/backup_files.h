// SPDX-License-Identifier: GPL-3.0-or-later
// Backups and increments made by hand.
#pragma once

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "common/backup_increment.h"
#include "core/base/random.h"

namespace shapedb::testing {

/// So many pages of noise, which begin as a database does.
inline std::string database(std::uint64_t pages, std::uint64_t seed) {
    Random random(seed);
    std::string text(static_cast<std::size_t>(pages * kBackupPageBytes), '\0');
    for (char& c : text) c = static_cast<char>(random.next());
    text.replace(0, 16, "SQLite format 3", 16);
    return text;
}

inline BackupManifest manifestOf(const std::string& backup, std::uint64_t blockBytes) {
    ManifestMaker maker(blockBytes);
    maker.add(backup.data(), backup.size());
    return maker.finish();
}

/// Its head with the blocks that this names.
inline std::string withBlocks(const IncrementHead& head, const std::string& result) {
    std::string text = encodeIncrementHead(head);
    for (const std::uint32_t block : head.changed) {
        text += result.substr(static_cast<std::size_t>(block * head.result.blockBytes),
                              static_cast<std::size_t>(head.result.blockBytes));
    }
    return text;
}

inline IncrementHead headBetween(const std::string& base, const std::string& result,
                                 std::uint64_t blockBytes = kBackupPageBytes) {
    const BackupManifest before = manifestOf(base, blockBytes);
    IncrementHead head;
    head.base = before.backup;
    head.result = manifestOf(result, blockBytes);
    head.changed = changedBlocks(before, head.result);
    return head;
}

inline std::string incrementBetween(const std::string& base, const std::string& result,
                                    std::uint64_t blockBytes = kBackupPageBytes) {
    return withBlocks(headBetween(base, result, blockBytes), result);
}

inline std::string writeBytes(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
}

inline std::string readBytes(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace shapedb::testing
