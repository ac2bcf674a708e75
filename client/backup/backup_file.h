// SPDX-License-Identifier: Apache-2.0
// The file that a backup or an increment is written to. Private to client/.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>

#include "core/base/error.h"

namespace shapedb::client {

/// Collects a backup in `PATH.part` and renames it once it is complete and on disk; without `commit` nothing
/// is left behind. Not thread-safe.
class BackupFile {
  public:
    explicit BackupFile(std::string path) : path_(std::move(path)), part_(path_ + ".part") {}
    BackupFile(const BackupFile&) = delete;
    BackupFile& operator=(const BackupFile&) = delete;
    ~BackupFile();

    /// Creates an empty file, dropping what an earlier attempt wrote.
    [[nodiscard]] Result<void> open();
    [[nodiscard]] Result<void> write(const char* data, std::size_t size);
    /// What was written can then be read at `partPath`.
    [[nodiscard]] Result<void> flush();
    [[nodiscard]] const std::string& partPath() const { return part_; }
    /// Flushes to disk and renames. Errors of all four: kFileNotWritable.
    [[nodiscard]] Result<void> commit();

  private:
    void discard();
    [[nodiscard]] tl::unexpected<Error> failed(const char* what) const;

    std::string path_;
    std::string part_;
    std::FILE* file_ = nullptr;
};

}  // namespace shapedb::client
