#include "server/rpc/backup_stream.h"

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"

namespace shapedb::rpc {
namespace {

Error writeError(int number) {
    const bool full = number == ENOSPC || number == EDQUOT || number == EFBIG;
    return {full ? ErrorCode::kStorageFull : ErrorCode::kFileNotWritable,
            "the received backup cannot be written: " + std::generic_category().message(number)};
}

}  // namespace

Result<void> sendFile(const std::string& path, const RunContext& context,
                      const std::function<Result<void>(const v1::BackupChunk&)>& send) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
    const auto unreadable = [] {
        return fail(ErrorCode::kFileNotReadable,
                    "the copy of the database cannot be read: " + std::generic_category().message(errno));
    };
    if (!file || std::fseek(file.get(), 0, SEEK_END) != 0) return unreadable();
    const long size = std::ftell(file.get());
    if (size < 0 || std::fseek(file.get(), 0, SEEK_SET) != 0) return unreadable();

    Sha256 hash;
    v1::BackupChunk chunk;
    chunk.set_total_bytes(static_cast<std::uint64_t>(size));
    for (std::uint64_t sent = 0; sent < static_cast<std::uint64_t>(size);) {
        RETURN_IF_ERROR(context.checkpoint());
        std::string* data = chunk.mutable_data();
        data->resize(catalog::kMaxChunkBytes);
        data->resize(std::fread(data->data(), 1, data->size(), file.get()));
        if (data->empty()) return unreadable();
        hash.update(data->data(), data->size());
        sent += data->size();
        RETURN_IF_ERROR(send(chunk));
        chunk.Clear();
    }
    const Sha256Digest digest = hash.finish();
    chunk.set_sha256(digest.data(), digest.size());
    return send(chunk);
}

Result<FileReceiver> FileReceiver::create(const std::string& path) {
    std::FILE* file = std::fopen(path.c_str(), "wbx");
    if (file == nullptr) return fail(writeError(errno));
    return FileReceiver(file);
}

Result<void> FileReceiver::write(const std::string& data) {
    if (data.empty()) return {};
    if (std::fwrite(data.data(), 1, data.size(), file_.get()) != data.size()) return fail(writeError(errno));
    hash_.update(data.data(), data.size());
    received_ += data.size();
    return {};
}

Result<void> FileReceiver::add(const v1::BackupChunk& chunk) {
    const auto malformed = [&](const std::string& what) {
        return fail(ErrorCode::kMalformedStream,
                    "backup after " + std::to_string(received_) + " bytes: " + what);
    };
    if (!wantedChecksum_.empty()) return malformed("message after the checksum, which comes last");
    if (first_ != (chunk.total_bytes() > 0)) {
        return malformed(first_ ? "the first message must say total_bytes"
                                : "total_bytes comes only in the first message");
    }
    if (first_) announced_ = chunk.total_bytes();
    first_ = false;
    if (chunk.data().empty() && chunk.sha256().empty()) return malformed("empty message");
    if (chunk.data().size() > catalog::kMaxChunkBytes) {
        return malformed("chunk of " + std::to_string(chunk.data().size()) + " bytes, at most " +
                         std::to_string(catalog::kMaxChunkBytes) + " are allowed");
    }
    if (received_ + chunk.data().size() > announced_) {
        return fail(ErrorCode::kCountMismatch,
                    "received more bytes than the " + std::to_string(announced_) + " announced");
    }
    if (!chunk.sha256().empty() && chunk.sha256().size() != Sha256Digest().size()) {
        return fail(ErrorCode::kInvalidArgument,
                    "sha256: " + std::to_string(chunk.sha256().size()) + " bytes, must be 32");
    }
    wantedChecksum_ = chunk.sha256();
    return write(chunk.data());
}

Result<void> FileReceiver::finish() {
    if (first_) return fail(ErrorCode::kMalformedStream, "the stream ended before the first message");
    if (received_ != announced_) {
        return fail(ErrorCode::kCountMismatch, std::to_string(received_) + " bytes received, " +
                                                   std::to_string(announced_) + " were announced");
    }
    if (wantedChecksum_.empty())
        return fail(ErrorCode::kMalformedStream, "the stream ended without a checksum");
    if (std::fclose(file_.release()) != 0) return fail(writeError(errno));
    const Sha256Digest digest = hash_.finish();
    if (std::memcmp(wantedChecksum_.data(), digest.data(), digest.size()) != 0) {
        return fail(ErrorCode::kChecksumMismatch, "the backup received has the SHA-256 " + toHex(digest) +
                                                      ", which is not the one sent with it: send it again");
    }
    return {};
}

}  // namespace shapedb::rpc
