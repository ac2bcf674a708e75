// SPDX-License-Identifier: GPL-3.0-or-later
// Sends and receives a database file, or what has changed in it, in chunks.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "common/backup_manifest.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/backup_upload.h"
#include "shapedb/v1/admin_service.pb.h"

namespace shapedb::rpc {

using SendChunk = std::function<Result<void>(const v1::BackupChunk&)>;

/// Sends a file: its size with the first chunk, its SHA-256 in a last message of its own.
/// Errors: those of `send`; kFileNotReadable, kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<void> sendFile(const std::string& path, const RunContext& context,
                                    const SendChunk& send);

/// Sends the increment that leads from `base` to a database file, as sendFile sends a file. Reads the file
/// twice. Its blocks are as large as those of `base`, or larger if they would be too many. Errors: those of
/// sendFile.
[[nodiscard]] Result<void> sendIncrement(const std::string& path, BackupManifest base,
                                         const RunContext& context, const SendChunk& send);

/// A manifest that a client sent. Errors: kInvalidArgument (a size or a length is wrong).
[[nodiscard]] Result<BackupManifest> checkedManifest(const v1::BackupManifest& manifest);

/// Writes chunks to a new file as far as catalog::BackupUpload takes them. After an error only destruction.
class FileReceiver {
  public:
    /// Errors: kFileNotWritable.
    [[nodiscard]] static Result<FileReceiver> create(const std::string& path);

    /// Errors: as BackupUpload::add; kStorageFull, kFileNotWritable.
    [[nodiscard]] Result<void> add(const v1::BackupChunk& chunk);

    /// Closes the file. Errors: as BackupUpload::finish; kStorageFull, kFileNotWritable.
    [[nodiscard]] Result<void> finish();

    [[nodiscard]] std::uint64_t bytes() const { return upload_.bytes(); }

  private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    explicit FileReceiver(std::FILE* file) : file_(file) {}

    std::unique_ptr<std::FILE, Close> file_;
    catalog::BackupUpload upload_;
};

}  // namespace shapedb::rpc
