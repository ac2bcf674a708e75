// A file that lives as long as the call that made it.
#pragma once

#include <string>

#include "core/base/error.h"

namespace shapedb::catalog {

/// A path for one new file in a folder of its own; both are removed when this is destroyed.
class TemporaryFile {
  public:
    /// Creates the folder inside `directory`, which must exist. Errors: kFileNotWritable.
    [[nodiscard]] static Result<TemporaryFile> create(const std::string& directory);
    ~TemporaryFile();
    TemporaryFile(TemporaryFile&& other) noexcept;
    TemporaryFile& operator=(TemporaryFile&&) = delete;

    /// The file does not exist at first.
    [[nodiscard]] std::string path() const { return folder_ + "/database"; }

  private:
    explicit TemporaryFile(std::string folder) : folder_(std::move(folder)) {}

    std::string folder_;  ///< empty when moved from
};

/// Creates the directory if it is missing and removes what a dead process left in it.
/// Errors: kFileNotWritable.
[[nodiscard]] Result<void> prepareTemporaryDirectory(const std::string& directory);

}  // namespace shapedb::catalog
