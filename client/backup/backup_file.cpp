// SPDX-License-Identifier: Apache-2.0
#include "client/backup/backup_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/return_if_error.h"

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

namespace {

tl::unexpected<Error> unreadable(const std::string& path, const std::string& why) {
    return fail(ErrorCode::kFileNotReadable, path + ": " + why);
}

}  // namespace

SourceFile::SourceFile(std::string path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}

SourceFile::SourceFile(SourceFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      bytes_(other.bytes_) {}

SourceFile& SourceFile::operator=(SourceFile&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(descriptor_, other.descriptor_);
    std::swap(bytes_, other.bytes_);
    return *this;
}

SourceFile::~SourceFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<SourceFile> SourceFile::open(const std::string& path) {
    // Never waits for a pipe.
    SourceFile file(path, ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat status {};
    if (file.descriptor_ < 0 || ::fstat(file.descriptor_, &status) != 0) {
        return unreadable(path, "cannot be opened: " + std::generic_category().message(errno));
    }
    if (!S_ISREG(status.st_mode)) return unreadable(path, "is not a file");
    if (status.st_size == 0) return unreadable(path, "is empty, not a backup");
    file.bytes_ = static_cast<std::uint64_t>(status.st_size);
    return file;
}

Result<void> SourceFile::read(std::uint64_t at, char* to, std::size_t size) const {
    for (std::size_t done = 0; done < size;) {
        const ssize_t got = ::pread(descriptor_, to + done, size - done, static_cast<off_t>(at + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) {
            const std::string why =
                got < 0 ? ": " + std::generic_category().message(errno) : ", where it ends";
            return unreadable(path_, "cannot be read beyond byte " + std::to_string(at + done) + why);
        }
        done += static_cast<std::size_t>(got);
    }
    return {};
}

Result<std::string> SourceFile::beginning(std::size_t most) const {
    std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(most, bytes_)), '\0');
    RETURN_IF_ERROR(read(0, text.data(), text.size()));
    return text;
}

}  // namespace shapedb::client
