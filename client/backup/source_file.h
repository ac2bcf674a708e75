// SPDX-License-Identifier: Apache-2.0
// A file that is read from any place. Private to client/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/error.h"

namespace shapedb::client {

/// Has the size that it had when it was opened. Not thread-safe.
class SourceFile {
  public:
    /// Errors: kFileNotReadable (missing, no permission, not a regular file, empty).
    [[nodiscard]] static Result<SourceFile> open(const std::string& path);
    SourceFile(SourceFile&& other) noexcept;
    SourceFile& operator=(SourceFile&& other) noexcept;
    ~SourceFile();

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

    /// Exactly `size` bytes from byte `at`. Errors: kFileNotReadable (also: the file ends before).
    [[nodiscard]] Result<void> read(std::uint64_t at, char* to, std::size_t size) const;
    /// The first bytes, at most `most`. Errors: kFileNotReadable.
    [[nodiscard]] Result<std::string> beginning(std::size_t most) const;

  private:
    SourceFile(std::string path, int descriptor);

    std::string path_;
    int descriptor_;
    std::uint64_t bytes_ = 0;
};

}  // namespace shapedb::client
