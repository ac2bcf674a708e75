// SPDX-License-Identifier: Apache-2.0
// The entries of a ZIP archive. Private to client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "client/io/input_file.h"
#include "core/base/error.h"

struct zip;

namespace shapedb::io {

/// Errors: kMalformedFile, naming the file. Not thread-safe.
class ZipArchive {
  public:
    /// Keeps the packed bytes in memory. `file` must outlive the archive.
    static Result<ZipArchive> read(InputFile& file);

    bool has(const std::string& entry) const;
    /// Calls visit(part) with the content of an entry, part after part, until it fails. What all entries
    /// unpack to is bounded like gzip data: an archive that is a bomb is an error.
    Result<void> visit(const std::string& entry, const std::function<Result<void>(std::string_view)>& visit);
    std::size_t packedBytes() const { return bytes_->size(); }

  private:
    struct Close {
        void operator()(zip* archive) const;
    };

    explicit ZipArchive(InputFile& file) : file_(&file) {}

    InputFile* file_;
    std::unique_ptr<std::string> bytes_;  // at a place that stays: the archive reads from it
    std::unique_ptr<zip, Close> archive_;
    std::uint64_t unpacked_ = 0;
};

}  // namespace shapedb::io
