// SPDX-License-Identifier: Apache-2.0
#include "client/io/output_file.h"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <new>
#include <random>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kWriteBufferBytes = std::size_t{1} << 20;
constexpr int kNameAttempts = 16;

Error notWritable(const std::string& path, int number) {
    return {ErrorCode::kFileNotWritable,
            path + ": cannot be written: " + std::generic_category().message(number)};
}

}  // namespace

Result<OutputFile> OutputFile::create(const std::string& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) return fail(notWritable(path, EISDIR));
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (descriptor < 0) return fail(notWritable(path, errno));
        return OutputFile(path, path, "", descriptor);
    }
    // Replace the file that a link points to, not the link.
    std::string target = path;
    if (fs::exists(status)) {
        const fs::path resolved = fs::canonical(path, error);
        if (!error) target = resolved.string();
        if (::access(target.c_str(), W_OK) != 0) return fail(notWritable(path, errno));
    }
    std::random_device random;
    for (int attempt = 0; attempt < kNameAttempts; ++attempt) {
        std::string temporary = target + "." + std::to_string(random()) + ".tmp";
        const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) return OutputFile(path, std::move(target), std::move(temporary), descriptor);
        if (errno != EEXIST) return fail(notWritable(path, errno));
    }
    return fail(notWritable(path, EEXIST));
}

OutputFile::OutputFile(std::string path, std::string target, std::string temporary, int descriptor)
    : path_(std::move(path)),
      target_(std::move(target)),
      temporary_(std::move(temporary)),
      descriptor_(descriptor) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, std::string())),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)) {}

OutputFile::~OutputFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<void> OutputFile::write(std::string_view bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    if (buffer_.size() < kWriteBufferBytes) return {};
    return flush();
}

Result<void> OutputFile::flush() {
    std::size_t done = 0;
    while (done < buffer_.size()) {
        const ssize_t written = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return fail(failed(errno));
        done += static_cast<std::size_t>(written);
    }
    buffer_.clear();
    return {};
}

Result<void> OutputFile::commit() {
    RETURN_IF_ERROR(flush());
    // A pipe or a terminal cannot be synchronised; that is fine.
    if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP && errno != EROFS) {
        return fail(failed(errno));
    }
    if (::close(std::exchange(descriptor_, -1)) != 0) return fail(failed(errno));
    if (temporary_.empty()) return {};
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) return fail(failed(errno));
    temporary_.clear();
    return {};
}

Error OutputFile::failed(int number) const { return notWritable(path_, number); }

}  // namespace shapedb::io

namespace shapedb {

Result<void> writeTextFile(const std::string& path, const std::string& text) {
    try {
        auto file = io::OutputFile::create(path);
        RETURN_IF_ERROR(file);
        RETURN_IF_ERROR(file->write(text));
        return file->commit();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, path + ": not enough memory to write the file");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kFileNotWritable, path + ": cannot be written: " + e.what());
    }
}

}  // namespace shapedb
