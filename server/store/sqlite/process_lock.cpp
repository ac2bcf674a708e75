#include "server/store/sqlite/process_lock.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "server/store/sqlite/connection.h"

namespace shapedb::store {

namespace {

std::string readOwner(int descriptor) {
    char text[32] = {};
    const ssize_t got = pread(descriptor, text, sizeof text - 1, 0);
    std::string owner(text, got > 0 ? static_cast<std::size_t>(got) : 0);
    while (!owner.empty() && (owner.back() == '\n' || owner.back() == '\0')) owner.pop_back();
    return owner.empty() ? "(not yet written)" : owner;
}

}  // namespace

ProcessLock::ProcessLock(const std::string& databasePath) {
    const std::string path = databasePath + ".lock";
    // O_CLOEXEC: a child that inherited the descriptor would hold the lock after our end.
    descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
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
    // Only for the message above: the lock holds without it, for example on a full device.
    const std::string pid = std::to_string(getpid()) + "\n";
    if (ftruncate(descriptor_, 0) == 0 && pwrite(descriptor_, pid.data(), pid.size(), 0) < 0) {
        static_cast<void>(ftruncate(descriptor_, 0));
    }
}

ProcessLock::~ProcessLock() { close(descriptor_); }

}  // namespace shapedb::store
