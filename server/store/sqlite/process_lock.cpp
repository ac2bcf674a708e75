// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/process_lock.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "server/store/sqlite/connection.h"

namespace shapedb::store {

namespace {

constexpr char kComplete[] = "complete\n";

std::string readLock(int descriptor) {
    char text[64] = {};
    const ssize_t got = pread(descriptor, text, sizeof text - 1, 0);
    return {text, got > 0 ? static_cast<std::size_t>(got) : 0};
}

std::string readOwner(int descriptor) {
    const std::string text = readLock(descriptor);
    const std::string owner = text.substr(0, text.find_first_of(std::string("\n\0", 2)));
    return owner.empty() ? "(not yet written)" : owner;
}

/// False if it cannot be written, as on a full device: the lock holds without it.
bool writeLock(int descriptor, bool complete) {
    const std::string text = std::to_string(getpid()) + "\n" + (complete ? kComplete : "");
    return pwrite(descriptor, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size()) &&
           ftruncate(descriptor, static_cast<off_t>(text.size())) == 0;
}

}  // namespace

ProcessLock::ProcessLock(const std::string& databasePath) {
    const std::string path = databasePath + ".lock";
    // O_CLOEXEC: a child that inherited the descriptor would hold the lock after our end.
    // O_NOFOLLOW: it is written, and what a link names is not ours.
    descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (descriptor_ < 0 && errno == ELOOP) {
        raise(ErrorCode::kStorage,
              "the lock file '" + path + "' is a symbolic link, which is not followed: remove it");
    }
    if (descriptor_ < 0) {
        const ErrorCode code = errno == ENOSPC ? ErrorCode::kStorageFull : ErrorCode::kStorage;
        raise(code, "cannot create lock file '" + path + "': " + std::strerror(errno));
    }
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
        const int why = errno;
        const std::string owner = readOwner(descriptor_);
        close(descriptor_);
        if (why != EWOULDBLOCK)
            raise(ErrorCode::kStorage, "cannot lock '" + path + "': " + std::strerror(why));
        raise(ErrorCode::kStorage, "database '" + databasePath + "' is in use by process " + owner +
                                       "; stop that server or choose another data folder");
    }
    wasComplete_ = readLock(descriptor_).find(kComplete) != std::string::npos;
    static_cast<void>(writeLock(descriptor_, wasComplete_));
}

void ProcessLock::setComplete() noexcept {
    if (!wasComplete_) wasComplete_ = writeLock(descriptor_, true);
}

ProcessLock::~ProcessLock() { close(descriptor_); }

}  // namespace shapedb::store
