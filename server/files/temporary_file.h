// SPDX-License-Identifier: GPL-3.0-or-later
// A file that lives as long as the call that made it, and whether the disk has room for it.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/base/error.h"

namespace shapedb::files {

/// A path for one new file in a folder of its own; both are removed when this is destroyed.
class TemporaryFile {
  public:
    /// How the names of the folders begin, and of the files in them.
    static constexpr const char* kFolderPrefix = "shapedb-";
    static constexpr const char* kFileName = "database";

    /// Creates the folder inside `directory`, which must exist. Errors: kFileNotWritable.
    [[nodiscard]] static Result<TemporaryFile> create(const std::string& directory);
    ~TemporaryFile();
    TemporaryFile(TemporaryFile&& other) noexcept;
    TemporaryFile& operator=(TemporaryFile&&) = delete;

    /// The file does not exist at first.
    [[nodiscard]] std::string path() const { return folder_ + "/" + kFileName; }

  private:
    explicit TemporaryFile(std::string folder) : folder_(std::move(folder)) {}

    std::string folder_;  ///< empty when moved from
};

/// Room that temporary files leave to the database, which shares the disk.
constexpr std::uint64_t kLeftToDatabase = std::uint64_t{256} << 20;

/// Errors: kStorageFull: the file system of `directory` has not `bytes` free beside kLeftToDatabase; `what`
/// begins the message, as "the backup". One whose free space cannot be told has room.
[[nodiscard]] Result<void> requireFreeSpace(const std::string& directory, std::uint64_t bytes,
                                            const std::string& what);

}  // namespace shapedb::files
