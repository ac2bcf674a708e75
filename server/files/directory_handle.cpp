// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/files/directory_handle.h"

#include <cerrno>
#include <memory>
#include <system_error>

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace shapedb::files {

namespace {

constexpr int kOpenFlags = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

std::string reason() { return std::generic_category().message(errno); }

}  // namespace

Result<DirectoryHandle> DirectoryHandle::open(const std::string& path) {
    const int descriptor = ::open(path.c_str(), kOpenFlags);
    if (descriptor >= 0) return DirectoryHandle(descriptor);
    struct stat status {};
    const bool link = ::lstat(path.c_str(), &status) == 0 && S_ISLNK(status.st_mode);
    return fail(ErrorCode::kFileNotWritable,
                path + (link ? " is a link, not a directory" : " cannot be opened: " + reason()));
}

DirectoryHandle::~DirectoryHandle() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<DirectoryHandle> DirectoryHandle::openInside(const std::string& name) const {
    const int descriptor = ::openat(descriptor_, name.c_str(), kOpenFlags);
    if (descriptor < 0) return fail(ErrorCode::kFileNotWritable, name + " cannot be opened: " + reason());
    return DirectoryHandle(descriptor);
}

Result<void> DirectoryHandle::forEach(const std::function<bool(const std::string&)>& visit) const {
    // A handle of its own: reading moves the position of the descriptor.
    const int again = ::openat(descriptor_, ".", kOpenFlags);
    const std::unique_ptr<DIR, int (*)(DIR*)> entries(again < 0 ? nullptr : ::fdopendir(again), ::closedir);
    if (!entries) {
        if (again >= 0) ::close(again);
        return fail(ErrorCode::kFileNotReadable, "the directory cannot be read: " + reason());
    }
    while (const dirent* entry = ::readdir(entries.get())) {
        const std::string name = entry->d_name;
        if (name != "." && name != ".." && !visit(name)) break;
    }
    return {};
}

bool DirectoryHandle::isOurs() const {
    struct stat status {};
    return ::fstat(descriptor_, &status) == 0 && status.st_uid == ::geteuid();
}

Result<void> DirectoryHandle::makePrivate() const {
    if (::fchmod(descriptor_, S_IRWXU) == 0) return {};
    return fail(ErrorCode::kFileNotWritable, "the directory cannot be made private: " + reason());
}

bool DirectoryHandle::removeFile(const std::string& name) const {
    return ::unlinkat(descriptor_, name.c_str(), 0) == 0;
}

bool DirectoryHandle::removeEmptyDirectory(const std::string& name) const {
    return ::unlinkat(descriptor_, name.c_str(), AT_REMOVEDIR) == 0;
}

}  // namespace shapedb::files
