// Sends and receives a database file in chunks.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "server/catalog/backup_upload.h"
#include "shapedb/v1/admin_service.pb.h"

namespace shapedb::rpc {

/// Sends a file: its size with the first chunk, its SHA-256 in a last message of its own.
/// Errors: those of `send`; kFileNotReadable, kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<void> sendFile(const std::string& path, const RunContext& context,
                                    const std::function<Result<void>(const v1::BackupChunk&)>& send);

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
