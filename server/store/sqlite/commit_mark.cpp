// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/commit_mark.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace shapedb::store {

namespace {

// A line of fixed length: one write of a few bytes, which leaves nothing of an older one.
constexpr std::string_view kHead = "shapedb commits ";
constexpr std::size_t kDigits = 20;
constexpr std::size_t kBytes = kHead.size() + kDigits + 1;

}  // namespace

CommitMark::CommitMark(const std::string& path)
    : folder_(std::filesystem::path(path).parent_path().string()),
      file_(::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR)) {}

CommitMark::~CommitMark() {
    if (file_ >= 0) ::close(file_);
}

std::optional<std::int64_t> CommitMark::read() const noexcept {
    std::array<char, kBytes + 1> line{};
    if (file_ < 0 || ::pread(file_, line.data(), line.size(), 0) != static_cast<ssize_t>(kBytes)) return {};
    if (std::string_view(line.data(), kHead.size()) != kHead || line[kBytes - 1] != '\n') return {};
    std::int64_t commits = 0;
    const char* const first = line.data() + kHead.size();
    const auto [end, error] = std::from_chars(first, first + kDigits, commits);
    if (error != std::errc() || end != first + kDigits || commits < 0) return {};
    return commits;
}

void CommitMark::write(std::int64_t commits) const noexcept {
    std::array<char, kBytes + 1> line{};
    std::snprintf(line.data(), line.size(), "%s%020lld\n", kHead.data(), static_cast<long long>(commits));
    // A mark that cannot be written is behind, and proves less.
    if (file_ >= 0) static_cast<void>(::pwrite(file_, line.data(), kBytes, 0) == 0);
}

bool CommitMark::sync() const noexcept {
    if (file_ < 0 || ::fsync(file_) != 0) return false;
    const int folder = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return false;
    const bool done = ::fsync(folder) == 0;
    ::close(folder);
    return done;
}

}  // namespace shapedb::store
