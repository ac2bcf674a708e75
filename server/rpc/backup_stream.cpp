#include "server/rpc/backup_stream.h"

#include <cerrno>
#include <system_error>

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
