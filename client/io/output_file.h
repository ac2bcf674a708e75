// SPDX-License-Identifier: Apache-2.0
// Files that appear complete or not at all.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace shapedb::io {

/// Private to client/io. The destructor removes what was not committed. Errors: kFileNotWritable. Not
/// thread-safe.
class OutputFile {
  public:
    static Result<OutputFile> create(const std::string& path);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    Result<void> write(std::string_view bytes);
    /// Flushes to the device and renames the file to its place.
    Result<void> commit();

  private:
    OutputFile(std::string path, std::string target, std::string temporary, int descriptor);

    Result<void> flush();
    Error failed(int number) const;

    std::string path_;       ///< as given by the caller, for messages
    std::string target_;     ///< with links resolved
    std::string temporary_;  ///< empty if written directly
    int descriptor_;
    std::vector<char> buffer_;
};

}  // namespace shapedb::io

namespace shapedb {

/// Writes a file of text. Errors: kFileNotWritable, naming the path; kOutOfMemory.
[[nodiscard]] Result<void> writeTextFile(const std::string& path, const std::string& text);

}  // namespace shapedb
