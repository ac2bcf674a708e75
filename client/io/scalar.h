// SPDX-License-Identifier: Apache-2.0
// The number types of binary PLY and PCD records. Private to client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace shapedb::io {

enum class ScalarType {
    kInt8,
    kUint8,
    kInt16,
    kUint16,
    kInt32,
    kUint32,
    kInt64,
    kUint64,
    kFloat32,
    kFloat64
};

constexpr std::size_t scalarSize(ScalarType type) {
    switch (type) {
        case ScalarType::kInt8:
        case ScalarType::kUint8: return 1;
        case ScalarType::kInt16:
        case ScalarType::kUint16: return 2;
        case ScalarType::kInt32:
        case ScalarType::kUint32:
        case ScalarType::kFloat32: return 4;
        case ScalarType::kInt64:
        case ScalarType::kUint64:
        case ScalarType::kFloat64: return 8;
    }
    return 0;
}

constexpr bool isFloating(ScalarType type) {
    return type == ScalarType::kFloat32 || type == ScalarType::kFloat64;
}

/// `bytes` may have any alignment.
template <typename T>
T loadAs(const char* bytes, bool swapped) {
    T value;
    if (!swapped || sizeof(T) == 1) {
        std::memcpy(&value, bytes, sizeof(T));
        return value;
    }
    char turned[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) turned[i] = bytes[sizeof(T) - 1 - i];
    std::memcpy(&value, turned, sizeof(T));
    return value;
}

/// `swapped`: the byte order is not this machine's. Exact, except for 64-bit integers beyond 2^53.
inline double loadScalar(const char* bytes, ScalarType type, bool swapped) {
    switch (type) {
        case ScalarType::kInt8: return loadAs<std::int8_t>(bytes, swapped);
        case ScalarType::kUint8: return loadAs<std::uint8_t>(bytes, swapped);
        case ScalarType::kInt16: return loadAs<std::int16_t>(bytes, swapped);
        case ScalarType::kUint16: return loadAs<std::uint16_t>(bytes, swapped);
        case ScalarType::kInt32: return loadAs<std::int32_t>(bytes, swapped);
        case ScalarType::kUint32: return loadAs<std::uint32_t>(bytes, swapped);
        case ScalarType::kInt64: return static_cast<double>(loadAs<std::int64_t>(bytes, swapped));
        case ScalarType::kUint64: return static_cast<double>(loadAs<std::uint64_t>(bytes, swapped));
        case ScalarType::kFloat32: return static_cast<double>(loadAs<float>(bytes, swapped));
        case ScalarType::kFloat64: return loadAs<double>(bytes, swapped);
    }
    return 0.0;
}

/// True if this machine stores the low byte first, as almost all do.
inline bool machineIsLittleEndian() {
    const std::uint16_t probe = 1;
    return loadAs<std::uint8_t>(reinterpret_cast<const char*>(&probe), false) == 1;
}

}  // namespace shapedb::io
