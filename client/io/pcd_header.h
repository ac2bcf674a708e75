// SPDX-License-Identifier: Apache-2.0
// The header of a PCD file: its fields, the number of points and the encoding. Private to client/io.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "client/io/input_file.h"
#include "client/io/scalar.h"
#include "core/base/error.h"

namespace shapedb::io {

struct PcdField {
    std::string name;
    std::uint64_t size = 4;
    char type = 'F';
    std::uint64_t count = 1;

    std::uint64_t bytes() const { return size * count; }
    // Padding before the next field.
    bool isPadding() const { return name == "_"; }
};

/// Nothing for a type that cannot be a coordinate.
std::optional<ScalarType> scalarType(const PcdField& field);

enum class PcdEncoding { kAscii, kBinary, kCompressed };

struct PcdHeader {
    std::vector<PcdField> fields;
    std::optional<std::uint64_t> width;
    std::optional<std::uint64_t> height;
    std::optional<std::uint64_t> points;
    PcdEncoding encoding = PcdEncoding::kAscii;
    std::array<std::size_t, 3> coordinates = {};  ///< the fields x, y and z

    std::uint64_t bytesPerPoint(bool withPadding) const {
        std::uint64_t sum = 0;
        for (const PcdField& field : fields) {
            if (withPadding || !field.isPadding()) sum += field.bytes();
        }
        return sum;
    }
};

/// Reads up to and including the line DATA. Keywords and the names x, y, z may be in upper case; the number
/// of points is known and every coordinate is one number of a known type. Errors: kMalformedFile with the
/// line.
Result<PcdHeader> readPcdHeader(InputFile& file);

}  // namespace shapedb::io
