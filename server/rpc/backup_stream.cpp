// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/backup_stream.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include <sys/types.h>

#include "common/backup_increment.h"
#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"

namespace shapedb::rpc {
namespace {

Error writeError(int number) {
    const bool full = number == ENOSPC || number == EDQUOT || number == EFBIG;
    return {full ? ErrorCode::kStorageFull : ErrorCode::kFileNotWritable,
            "the received backup cannot be written: " + std::generic_category().message(number)};
}

/// A file that was made for this call.
class OwnFile {
  public:
    /// Errors, here and below: kFileNotReadable.
    static Result<OwnFile> open(const std::string& path) {
        OwnFile file(std::fopen(path.c_str(), "rb"));
        if (!file.file_ || ::fseeko(file.file_.get(), 0, SEEK_END) != 0) return unreadable();
        const off_t size = ::ftello(file.file_.get());
        if (size < 0) return unreadable();
        file.bytes_ = static_cast<std::uint64_t>(size);
        return file;
    }
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

    /// Calls `take(data, size)` with the bytes from `begin` to `end`, a chunk at a time.
    template <typename Take>
    Result<void> read(std::uint64_t begin, std::uint64_t end, const RunContext& context, Take&& take) {
        if (::fseeko(file_.get(), static_cast<off_t>(begin), SEEK_SET) != 0) return unreadable();
        while (begin < end) {
            RETURN_IF_ERROR(context.checkpoint());
            buffer_.resize(
                static_cast<std::size_t>(std::min<std::uint64_t>(catalog::kMaxChunkBytes, end - begin)));
            if (std::fread(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size()) {
                return unreadable();
            }
            begin += buffer_.size();
            RETURN_IF_ERROR(take(buffer_.data(), buffer_.size()));
        }
        return {};
    }

  private:
    explicit OwnFile(std::FILE* file) : file_(file, std::fclose) {}
    static tl::unexpected<Error> unreadable() {
        return fail(ErrorCode::kFileNotReadable,
                    "the copy of the database cannot be read: " + std::generic_category().message(errno));
    }

    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
    std::uint64_t bytes_ = 0;
    std::string buffer_;
};

/// Cuts what is sent into chunks.
class ChunkSender {
  public:
    ChunkSender(std::uint64_t totalBytes, const SendChunk& send) : send_(send) {
        chunk_.set_total_bytes(totalBytes);
    }

    Result<void> add(const char* data, std::size_t size) {
        hash_.update(data, size);
        while (size > 0) {
            std::string* const filled = chunk_.mutable_data();
            const std::size_t piece = std::min(size, catalog::kMaxChunkBytes - filled->size());
            filled->append(data, piece);
            data += piece;
            size -= piece;
            if (filled->size() == catalog::kMaxChunkBytes) RETURN_IF_ERROR(flush());
        }
        return {};
    }
    Result<void> finish() {
        if (!chunk_.data().empty()) RETURN_IF_ERROR(flush());
        const Sha256Digest digest = hash_.finish();
        chunk_.set_sha256(digest.data(), digest.size());
        return send_(chunk_);
    }

  private:
    Result<void> flush() {
        RETURN_IF_ERROR(send_(chunk_));
        chunk_.Clear();
        return {};
    }

    const SendChunk& send_;
    v1::BackupChunk chunk_;
    Sha256 hash_;
};

/// The beginning of the increment from `base` to the file.
Result<IncrementHead> headOf(OwnFile& file, BackupManifest base, const RunContext& context) {
    const std::uint64_t blockBytes = std::max(base.blockBytes, backupBlockBytes(file.bytes()));
    ManifestMaker maker(blockBytes);
    RETURN_IF_ERROR(file.read(0, file.bytes(), context, [&](const char* data, std::size_t size) {
        maker.add(data, size);
        return Result<void>();
    }));
    IncrementHead head;
    head.base = base.backup;
    head.result = maker.finish();
    head.changed = changedBlocks(coarsened(std::move(base), blockBytes), head.result);
    return head;
}

}  // namespace

Result<void> sendFile(const std::string& path, const RunContext& context, const SendChunk& send) {
    auto file = OwnFile::open(path);
    RETURN_IF_ERROR(file);
    ChunkSender sender(file->bytes(), send);
    RETURN_IF_ERROR(file->read(0, file->bytes(), context,
                               [&](const char* data, std::size_t size) { return sender.add(data, size); }));
    return sender.finish();
}

Result<void> sendIncrement(const std::string& path, BackupManifest base, const RunContext& context,
                           const SendChunk& send) {
    auto file = OwnFile::open(path);
    RETURN_IF_ERROR(file);
    const auto head = headOf(*file, std::move(base), context);
    RETURN_IF_ERROR(head);
    const std::string beginning = encodeIncrementHead(*head);
    ChunkSender sender(beginning.size() + changedBytes(*head), send);
    RETURN_IF_ERROR(sender.add(beginning.data(), beginning.size()));
    const std::uint64_t blockBytes = head->result.blockBytes;
    for (const std::uint32_t block : head->changed) {
        const std::uint64_t begin = block * blockBytes;
        const std::uint64_t end = begin + bytesOfBlock(file->bytes(), blockBytes, block);
        RETURN_IF_ERROR(file->read(
            begin, end, context, [&](const char* data, std::size_t size) { return sender.add(data, size); }));
    }
    return sender.finish();
}

Result<BackupManifest> checkedManifest(const v1::BackupManifest& manifest) {
    const auto wrong = [](const std::string& what) {
        return fail(ErrorCode::kInvalidArgument, "since: " + what);
    };
    BackupManifest checked;
    checked.backup.bytes = manifest.bytes();
    checked.blockBytes = manifest.block_bytes();
    if (const auto cut = checkBlocks(checked.backup.bytes, checked.blockBytes); !cut) {
        return wrong(cut.error().message);
    }
    if (manifest.sha256().size() != sizeof(Sha256Digest)) {
        return wrong("sha256 has " + std::to_string(manifest.sha256().size()) + " bytes, must be " +
                     std::to_string(sizeof(Sha256Digest)));
    }
    const std::uint64_t blocks = countBlocks(checked.backup.bytes, checked.blockBytes);
    if (manifest.block_hashes().size() != blocks * sizeof(Sha256Digest)) {
        return wrong("block_hashes has " + std::to_string(manifest.block_hashes().size()) +
                     " bytes, must be " + std::to_string(blocks * sizeof(Sha256Digest)) + " for " +
                     std::to_string(blocks) + " blocks");
    }
    std::memcpy(checked.backup.sha256.data(), manifest.sha256().data(), sizeof(Sha256Digest));
    checked.blocks.resize(static_cast<std::size_t>(blocks));
    std::memcpy(checked.blocks.data(), manifest.block_hashes().data(), manifest.block_hashes().size());
    return checked;
}

Result<FileReceiver> FileReceiver::create(const std::string& path) {
    std::FILE* file = std::fopen(path.c_str(), "wbx");
    if (file == nullptr) return fail(writeError(errno));
    return FileReceiver(file);
}

Result<void> FileReceiver::add(const v1::BackupChunk& chunk) {
    const std::string& data = chunk.data();
    RETURN_IF_ERROR(upload_.add({chunk.total_bytes(), data, chunk.sha256()}));
    if (std::fwrite(data.data(), 1, data.size(), file_.get()) != data.size()) return fail(writeError(errno));
    return {};
}

Result<void> FileReceiver::finish() {
    RETURN_IF_ERROR(upload_.finish());
    if (std::fclose(file_.release()) != 0) return fail(writeError(errno));
    return {};
}

}  // namespace shapedb::rpc
