// SPDX-License-Identifier: Apache-2.0
// What a file is by how it begins. Asked only after a reader has refused the file: nothing that is read
// depends on it. Private to client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace shapedb::io {

/// So many bytes of the start are enough.
constexpr std::size_t kKindBytes = std::size_t{1} << 16;

/// The ending that the file should have: ".ply" (the first one of formats with several, but ".glb" for binary
/// glTF). Empty if it begins like none that is read. `size` of the whole file, if it is known: binary STL has
/// no other mark.
std::string_view endingOfContent(std::string_view head, std::optional<std::uint64_t> size);

/// The header of a PLY or PCD file announces binary data, and text follows.
bool hasTextForBinary(std::string_view head);

/// For messages, of such an ending: "a PLY file".
std::string_view kindName(std::string_view ending);

/// How to get a file that we do not read into a format that we do. For an ending in lower case with its dot:
/// what its format is and which program converts it; empty for an ending that says nothing.
std::string conversionAdvice(std::string_view ending);

}  // namespace shapedb::io
