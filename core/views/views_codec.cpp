// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/views_codec.h"

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/base/stored_bytes.h"

namespace shapedb {

namespace {

// Persisted: never change. docs/views.md describes every byte.
constexpr char kMagic[4] = {'S', 'D', 'B', 'V'};
constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::size_t kStoredBytes = kHeaderBytes + kViews * (kViewBytes + sizeof(float)) + kChecksumBytes;

tl::unexpected<Error> damaged(const std::string& how) {
    return fail(ErrorCode::kDataLoss, "the stored views are damaged: " + how);
}

}  // namespace

std::string encodeViews(const ViewSet& set) {
    std::string bytes;
    bytes.reserve(kStoredBytes);
    bytes.append(kMagic, sizeof kMagic);
    putUnsigned(bytes, kVersion);
    putUnsigned(bytes, static_cast<std::uint8_t>(kViews));
    putUnsigned(bytes, std::uint16_t{0});
    for (const ViewSignature& view : set.views) {
        for (const std::uint8_t levels : view.levels) putUnsigned(bytes, levels);
        putFloat(bytes, view.size);
    }
    putUnsigned(bytes, checksumOf(bytes.data(), bytes.size()));
    return bytes;
}

Result<ViewSet> decodeViews(const std::string& bytes) {
    if (bytes.size() < kHeaderBytes) return damaged("only " + std::to_string(bytes.size()) + " bytes");
    if (std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) return damaged("they do not begin with SDBV");
    ByteReader reader(bytes.data() + sizeof kMagic);
    const int version = reader.takeUnsigned<std::uint8_t>();
    if (version == 0) return damaged("version 0");
    if (version > kVersion) {
        return fail(ErrorCode::kSchemaTooNew, "the stored views have version " + std::to_string(version) +
                                                  "; this program knows up to " + std::to_string(kVersion));
    }
    const std::size_t count = reader.takeUnsigned<std::uint8_t>();
    if (count != kViews) return damaged(std::to_string(count) + " views instead of 20");
    if (reader.takeUnsigned<std::uint16_t>() != 0) return damaged("a reserved byte is not 0");
    if (bytes.size() != kStoredBytes) {
        return damaged(std::to_string(bytes.size()) + " bytes instead of " + std::to_string(kStoredBytes));
    }
    const std::size_t body = kStoredBytes - kChecksumBytes;
    if (ByteReader(bytes.data() + body).takeUnsigned<std::uint32_t>() != checksumOf(bytes.data(), body)) {
        return damaged("the checksum is wrong");
    }
    ViewSet set;
    for (ViewSignature& view : set.views) {
        for (std::uint8_t& levels : view.levels) levels = reader.takeUnsigned<std::uint8_t>();
        view.size = reader.takeFloat();
        if (!(view.size >= 0.0f) || !std::isfinite(view.size)) return damaged("a size is out of range");
    }
    return set;
}

}  // namespace shapedb
