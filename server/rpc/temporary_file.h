// A file that is gone when the call that made it is.
#pragma once

#include <string>

#include "core/base/error.h"

namespace shapedb::rpc {

/// A place for one new file, in a folder of its own; all of it is removed when destroyed.
class TemporaryFile {
  public:
    /// Creates the folder inside `directory`, which must exist. Errors: kFileNotWritable.
    [[nodiscard]] static Result<TemporaryFile> create(const std::string& directory);
    ~TemporaryFile();
    TemporaryFile(TemporaryFile&& other) noexcept;
    TemporaryFile& operator=(TemporaryFile&&) = delete;

    /// Of the file, which does not exist yet.
    [[nodiscard]] std::string path() const { return folder_ + "/database"; }

  private:
    explicit TemporaryFile(std::string folder) : folder_(std::move(folder)) {}

    std::string folder_;  ///< empty when moved from
};

/// Creates the directory if missing and removes what a dead process left in it.
/// Errors: kFileNotWritable.
[[nodiscard]] Result<void> prepareTemporaryDirectory(const std::string& directory);

}  // namespace shapedb::rpc
