// SPDX-License-Identifier: Apache-2.0
// The files of backups and increments: one that is written, one that is read from any place. Private to
// client/.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// A file that is read from any place. Has the size that it had when it was opened. Not thread-safe.
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
