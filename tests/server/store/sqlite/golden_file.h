// SPDX-License-Identifier: GPL-3.0-or-later
// The packed files of tests/golden/.
#pragma once

#include <string>

#include <gtest/gtest.h>
#include <zstd.h>

#include "tests/server/store/store_fixture.h"

namespace shapedb::store {

/// The content of tests/golden/NAME.db.zst; empty if it is missing. As a server that ends cleanly leaves a
/// file: without a log, which those of the time had.
inline std::string unpackedGolden(const std::string& name) {
    const std::string packed = slurp(std::string(SHAPEDB_GOLDEN_DIR) + "/" + name + ".db.zst");
    if (packed.empty()) return {};
    std::string bytes(ZSTD_getFrameContentSize(packed.data(), packed.size()), ' ');
    EXPECT_EQ(ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()), bytes.size());
    // SQLite's header: the versions for writing and reading.
    if (bytes.size() > 19) bytes[18] = bytes[19] = 1;
    return bytes;
}

inline void writeGolden(const std::string& path, const std::string& bytes) {
    std::string packed(ZSTD_compressBound(bytes.size()), ' ');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 19));
    spill(path, packed);
}

}  // namespace shapedb::store
