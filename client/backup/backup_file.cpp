// SPDX-License-Identifier: Apache-2.0
#include "client/backup/backup_file.h"

#include <cerrno>
#include <cstring>

#include <unistd.h>

namespace shapedb::client {

BackupFile::~BackupFile() { discard(); }

void BackupFile::discard() {
    if (file_ == nullptr) return;
    std::fclose(file_);
    file_ = nullptr;
    std::remove(part_.c_str());
}

tl::unexpected<Error> BackupFile::failed(const char* what) const {
    return fail(ErrorCode::kFileNotWritable,
                std::string("cannot ") + what + " " + part_ + ": " + std::strerror(errno));
}

Result<void> BackupFile::open() {
    discard();
    file_ = std::fopen(part_.c_str(), "wb");
    if (file_ == nullptr) return failed("create");
    return {};
}

Result<void> BackupFile::write(const char* data, std::size_t size) {
    if (std::fwrite(data, 1, size, file_) != size) return failed("write");
    return {};
}

Result<void> BackupFile::flush() {
    if (std::fflush(file_) != 0) return failed("write");
    return {};
}

Result<void> BackupFile::commit() {
    if (std::fflush(file_) != 0 || fsync(fileno(file_)) != 0) return failed("write");
    const int closed = std::fclose(file_);
    file_ = nullptr;
    if (closed != 0 || std::rename(part_.c_str(), path_.c_str()) != 0) {
        const auto error = failed("finish");
        std::remove(part_.c_str());
        return error;
    }
    return {};
}

}  // namespace shapedb::client
