// SPDX-License-Identifier: Apache-2.0
#include "common/small_file.h"

#include <array>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace shapedb {
namespace {

class Descriptor {
  public:
    // Without waiting: opening a pipe would block until somebody writes to it.
    explicit Descriptor(const std::string& path)
        : file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
    ~Descriptor() {
        if (file_ >= 0) ::close(file_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int get() const { return file_; }

  private:
    int file_;
};

}  // namespace

Result<std::string> readSmallFile(const char* what, const std::string& path, std::size_t most) {
    const auto unreadable = [&](const std::string& why) {
        return fail(ErrorCode::kFileNotReadable, std::string(what) + " " + path + " cannot be read: " + why);
    };
    const Descriptor file(path);
    struct stat status {};
    if (file.get() < 0 || ::fstat(file.get(), &status) != 0) {
        return unreadable(std::generic_category().message(errno));
    }
    if (!S_ISREG(status.st_mode)) return unreadable("it is not a regular file");
    std::string text;
    std::array<char, 16'384> piece{};
    while (text.size() <= most) {
        const ssize_t got = ::read(file.get(), piece.data(), piece.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return unreadable(std::generic_category().message(errno));
        if (got == 0) return text;
        text.append(piece.data(), static_cast<std::size_t>(got));
    }
    return fail(ErrorCode::kMalformedFile,
                std::string(what) + " " + path + " has more than " + std::to_string(most) + " bytes");
}

}  // namespace shapedb
