// SPDX-License-Identifier: Apache-2.0
// The header of a PLY file: its elements, their properties and the encoding. Private to client/io.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/io/input_file.h"
#include "client/io/scalar.h"
#include "core/base/error.h"

namespace shapedb::io {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
    std::string name;                        ///< printable
    ScalarType type = ScalarType::kFloat32;  ///< of the value, or of each entry of the list
    bool isList = false;
    ScalarType countType = ScalarType::kUint8;  ///< of the number before a list
};

struct PlyElement {
    std::string name;         ///< in lower case, printable
    std::uint64_t count = 0;  ///< as announced, not yet verified
    std::vector<PlyProperty> properties;

    /// Bytes of one binary record; nothing if it has a list.
    std::optional<std::uint64_t> fixedSize() const;
    /// The fewest bytes that one record can take.
    std::uint64_t leastSize(PlyEncoding encoding) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kAscii;
    std::vector<PlyElement> elements;
};

/// Stops at the first byte after the header. Errors: kMalformedFile with the line.
Result<PlyHeader> readPlyHeader(InputFile& file);

}  // namespace shapedb::io
