// SPDX-License-Identifier: GPL-3.0-or-later
// For tests of stored bytes: as text, and forged ones that must be refused.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "core/signature/signature_codec.h"

namespace shapedb::testing_support {

inline std::string toHex(const std::string& bytes) {
    std::string hex;
    for (const char c : bytes) {
        char two[3];
        std::snprintf(two, sizeof two, "%02x", static_cast<unsigned char>(c));
        hex += two;
    }
    return hex;
}

/// The last four bytes replaced by the checksum of those before, so that only the checks of numbers can
/// refuse. A second CRC-32, by the bits.
inline std::string withChecksum(std::string bytes) {
    bytes.resize(bytes.size() - 4);
    std::uint32_t crc = 0xffffffffu;
    for (const char c : bytes) {
        for (int bit = 0; bit < 8; ++bit) {
            const std::uint32_t in = (static_cast<unsigned char>(c) >> bit) & 1u;
            crc = ((crc ^ in) & 1u) != 0 ? (crc >> 1) ^ 0xedb88320u : crc >> 1;
        }
    }
    crc = ~crc;
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>((crc >> (8 * i)) & 0xffu));
    return bytes;
}

/// `word` is in the message.
inline void expectMalformed(const std::string& bytes, const std::string& word = "") {
    const auto decoded = decodeSignature(bytes);
    ASSERT_FALSE(decoded) << word;
    EXPECT_EQ(decoded.error().code, ErrorCode::kMalformedSignature);
    EXPECT_NE(decoded.error().message.find(word), std::string::npos) << decoded.error().message;
}

}  // namespace shapedb::testing_support
