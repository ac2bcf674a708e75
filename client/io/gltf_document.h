// SPDX-License-Identifier: Apache-2.0
// A glTF 2.0 document with its binary data, and typed access to both that never leaves their bounds. Private
// to client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/io/input_file.h"
#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::io {

/// All errors are kMalformedFile, or kFileNotReadable for a file that a buffer names. Not thread-safe.
class GltfDocument {
  public:
    /// From .gltf text or a .glb container, whichever the file is.
    static Result<GltfDocument> read(InputFile& file);

    const nlohmann::json& root() const { return root_; }
    const std::string& format() const { return format_; }
    /// Bytes of the file and of the files that it names: a bound for what can be in them.
    std::uint64_t bytesRead() const { return bytesRead_; }

    /// The element `index` of the array `name`; an error that says who names it if there is none.
    Result<const nlohmann::json*> element(const char* name, std::uint64_t index,
                                          const std::string& who) const;

    /// An accessor of VEC3 with any component type.
    Result<std::vector<Point3>> positions(std::uint64_t accessor);
    /// An accessor of unsigned SCALAR.
    Result<std::vector<std::uint32_t>> indices(std::uint64_t accessor);

    Error malformed(const std::string& what) const;

  private:
    struct View {
        std::string_view bytes;
        std::uint64_t stride = 0;  ///< 0: elements follow each other
    };
    struct Layout {
        std::uint64_t count = 0;
        std::uint64_t components = 1;
        std::uint64_t componentType = 0;
        std::uint64_t componentSize = 0;
        bool normalized = false;

        std::uint64_t elementSize() const { return components * componentSize; }
    };

    explicit GltfDocument(InputFile& file) : file_(&file) {}

    Result<void> readContainer(std::string&& bytes);
    Result<void> parse(std::string_view text);
    Result<void> checkExtensions() const;
    Result<const std::string*> buffer(std::uint64_t index);
    Result<std::string> loadBuffer(const nlohmann::json& buffer, std::uint64_t index);
    Result<std::string> loadFile(const std::string& uri, const std::string& who);
    Result<View> view(std::uint64_t index);
    Result<Layout> layout(const nlohmann::json& accessor, const std::string& who,
                          std::uint64_t components) const;
    Result<std::vector<double>> values(std::uint64_t accessor, std::uint64_t components);
    Result<void> readDense(const nlohmann::json& holder, const Layout& layout, const std::string& who,
                           std::vector<double>& values);
    Result<void> readSparse(const nlohmann::json& sparse, const Layout& layout, const std::string& who,
                            std::vector<double>& values);

    InputFile* file_;
    nlohmann::json root_;
    std::string format_;
    std::optional<std::string> binaryChunk_;
    std::map<std::uint64_t, std::string> buffers_;
    std::uint64_t bytesRead_ = 0;
};

/// The member `name` as a whole number that is not negative; nothing if there is none or it is something
/// else.
std::optional<std::uint64_t> wholeNumber(const nlohmann::json& object, const char* name);

}  // namespace shapedb::io
