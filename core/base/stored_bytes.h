// SPDX-License-Identifier: Apache-2.0
// How numbers are written into stored bytes: little-endian on every machine, with a checksum at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include <zlib.h>

namespace shapedb {

/// CRC-32 (IEEE 802.3, reflected), by zlib for speed: a starting server reads a million signatures.
[[nodiscard]] inline std::uint32_t checksumOf(const char* bytes, std::size_t size) {
    return static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(bytes), static_cast<uInt>(size)));
}

template <typename Unsigned>
void putUnsigned(std::string& out, Unsigned value) {
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i)
        out.push_back(static_cast<char>((value >> (8 * i)) & 0xffu));
}

inline void putFloat(std::string& out, float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    putUnsigned(out, bits);
}

inline void putDouble(std::string& out, double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    putUnsigned(out, bits);
}

/// Reads from bytes whose length has been checked.
class ByteReader {
  public:
    explicit ByteReader(const char* at) : at_(at) {}

    template <typename Unsigned>
    Unsigned takeUnsigned() {
        Unsigned value = 0;
        for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
            // Shifts instead of a copy: the same on machines of either byte order.
            value = static_cast<Unsigned>(
                value | (static_cast<Unsigned>(static_cast<unsigned char>(at_[i])) << (8 * i)));
        }
        at_ += sizeof(Unsigned);
        return value;
    }
    float takeFloat() {
        const auto bits = takeUnsigned<std::uint32_t>();
        float value = 0.0f;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
    double takeDouble() {
        const auto bits = takeUnsigned<std::uint64_t>();
        double value = 0.0;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }

  private:
    const char* at_;
};

}  // namespace shapedb
