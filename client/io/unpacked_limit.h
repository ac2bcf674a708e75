// SPDX-License-Identifier: Apache-2.0
// How much packed data may unpack to. Private to client/io.
#pragma once

#include <cstdint>
#include <string>

namespace shapedb::io {

/// Scans as text shrink to a third, those of few different numbers to a twentieth.
constexpr std::uint64_t kGreatestPackingRatio = 200;
constexpr std::uint64_t kAlwaysUnpackedBytes = std::uint64_t{64} << 20;

inline bool isBomb(std::uint64_t unpacked, std::uint64_t packed) {
    return unpacked > kAlwaysUnpackedBytes && unpacked / kGreatestPackingRatio > packed;
}

inline std::string bombText() {
    return "more than " + std::to_string(kGreatestPackingRatio) +
           " times as large when unpacked, which is not read from packed files; if it is meant to be, unpack "
           "it "
           "first, e.g. with gunzip";
}

}  // namespace shapedb::io
