// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/space_reserve.h"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace shapedb::store {

SpaceReserve::SpaceReserve(std::string path, std::uint64_t bytes) : path_(std::move(path)), bytes_(bytes) {
    file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
}

SpaceReserve::~SpaceReserve() {
    if (file_ >= 0) ::close(file_);
}

Result<void> SpaceReserve::hold() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return take();
}

Result<void> SpaceReserve::take() {
    if (held_ || file_ < 0) return {};
    const int failed = ::posix_fallocate(file_, 0, static_cast<off_t>(bytes_));
    held_ = failed == 0;
    if (failed != ENOSPC && failed != EDQUOT) return {};
    // A part of it may have been taken.
    static_cast<void>(::ftruncate(file_, 0) == 0);
    return fail(ErrorCode::kStorageFull, "the disk is full but for " + std::to_string(bytes_ >> 20) +
                                             " MiB that deletions may need: free some space on the device");
}

bool SpaceReserve::release() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return give();
}

bool SpaceReserve::give() {
    if (!held_) return false;
    held_ = false;
    return ::ftruncate(file_, 0) == 0;
}

SpaceReserve::Loan::Loan(SpaceReserve& reserve) : reserve_(reserve), lock_(reserve.mutex_) {
    static_cast<void>(reserve_.give());
}

SpaceReserve::Loan::~Loan() { static_cast<void>(reserve_.take()); }

}  // namespace shapedb::store
