// Sends and receives a database file in chunks.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "common/sha256.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "shapedb/v1/admin_service.pb.h"

namespace shapedb::rpc {

/// Sends a file: its size with the first chunk, its SHA-256 in a last message of its own.
/// Errors: those of `send`; kFileNotReadable, kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<void> sendFile(const std::string& path, const RunContext& context,
                                    const std::function<Result<void>(const v1::BackupChunk&)>& send);

/// Writes chunks to a new file and checks them. After an error only destruction.
class FileReceiver {
  public:
    /// Errors: kFileNotWritable.
    [[nodiscard]] static Result<FileReceiver> create(const std::string& path);

    /// Errors: kMalformedStream (no size in the first message, or a size in a later one; a message after
    /// the checksum; a chunk over 1 MiB; an empty message), kCountMismatch (more than announced),
    /// kInvalidArgument (checksum not 32 bytes), kStorageFull, kFileNotWritable.
    [[nodiscard]] Result<void> add(const v1::BackupChunk& chunk);

    /// Closes the file. Errors: kMalformedStream (no checksum came), kCountMismatch,
    /// kChecksumMismatch, kStorageFull.
    [[nodiscard]] Result<void> finish();

    [[nodiscard]] std::uint64_t bytes() const { return received_; }

  private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    explicit FileReceiver(std::FILE* file) : file_(file) {}
    Result<void> write(const std::string& data);

    std::unique_ptr<std::FILE, Close> file_;
    bool first_ = true;
    std::uint64_t announced_ = 0;
    std::uint64_t received_ = 0;
    std::string wantedChecksum_;
    Sha256 hash_;
};

}  // namespace shapedb::rpc
