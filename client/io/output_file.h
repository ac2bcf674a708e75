// A file that appears under its name whole or not at all. Private to client/io.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace shapedb::io {

/// Not thread-safe. What is not committed is removed by the destructor. Errors: kFileNotWritable.
class OutputFile {
  public:
    static Result<OutputFile> create(const std::string& path);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    Result<void> write(std::string_view bytes);
    /// Writes out everything, down to the device, and puts the file in its place.
    Result<void> commit();

  private:
    OutputFile(std::string path, std::string target, std::string temporary, int descriptor);

    Result<void> flush();
    Error failed(int number) const;

    std::string path_;       ///< as the caller named it, for messages
    std::string target_;     ///< where it goes, links resolved
    std::string temporary_;  ///< empty when written directly
    int descriptor_;
    std::vector<char> buffer_;
};

}  // namespace shapedb::io
