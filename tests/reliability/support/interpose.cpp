// SPDX-License-Identifier: GPL-3.0-or-later
// The program's own fsync, rename and remove, used by SQLite and the store alike: the C library's, seen by
// the disk (disk.h) and failing as asked (faults.h).
#include <cerrno>
#include <cstdio>
#include <string>

#include <dlfcn.h>
#include <unistd.h>

#include "tests/reliability/support/disk.h"
#include "tests/reliability/support/faults.h"

namespace shapedb::reliability {

namespace {

template <typename Function>
Function libraryFunction(const char* name) {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

std::string pathOf(int descriptor) {
    char path[4096];
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    const ssize_t size = readlink(link.c_str(), path, sizeof path);
    return {path, size > 0 ? static_cast<std::size_t>(size) : 0};
}

/// Takes no memory when there is no disk: the store may be out of it.
Disk* diskAt(const char* path) { return Disk::current() != nullptr ? Disk::of(path) : nullptr; }

int failWith(FaultKind kind) {
    errno = Faults::systemError(kind);
    return -1;
}

// Nothing is really synced, for speed: the machine that runs the tests keeps its power.
int syncOf(int descriptor) {
    if (Disk::current() == nullptr) return 0;
    const std::string path = pathOf(descriptor);
    if (Disk* const disk = Disk::of(path)) disk->synced(path);
    return 0;
}

}  // namespace

}  // namespace shapedb::reliability

using shapedb::reliability::Call;
using shapedb::reliability::Disk;
using shapedb::reliability::Faults;

extern "C" {

int fsync(int descriptor) {
    if (const auto fault = Faults::next(Call::kSync)) {
        const std::string path = shapedb::reliability::pathOf(descriptor);
        if (Disk* const disk = Disk::of(path)) disk->syncFailed(path);
        return shapedb::reliability::failWith(*fault);
    }
    return shapedb::reliability::syncOf(descriptor);
}

int fdatasync(int descriptor) { return shapedb::reliability::syncOf(descriptor); }

int rename(const char* from, const char* to) noexcept {
    using Rename = int (*)(const char*, const char*);
    static const auto real = shapedb::reliability::libraryFunction<Rename>("rename");
    if (const auto fault = Faults::next(Call::kRename)) return shapedb::reliability::failWith(*fault);
    if (Disk* const disk = shapedb::reliability::diskAt(from)) disk->renamed(from, to);
    return real(from, to);
}

int renameat2(int fromFolder, const char* from, int toFolder, const char* to, unsigned flags) noexcept {
    using Rename = int (*)(int, const char*, int, const char*, unsigned);
    static const auto real = shapedb::reliability::libraryFunction<Rename>("renameat2");
    if (const auto fault = Faults::next(Call::kRename)) return shapedb::reliability::failWith(*fault);
    // Told first, so that it can be interrupted: a backup's name is free, as the store has checked.
    if (Disk* const disk = shapedb::reliability::diskAt(from)) disk->renamed(from, to);
    return real(fromFolder, from, toFolder, to, flags);
}

int remove(const char* path) noexcept {
    using Remove = int (*)(const char*);
    static const auto real = shapedb::reliability::libraryFunction<Remove>("remove");
    if (Disk* const disk = shapedb::reliability::diskAt(path)) disk->removed(path);
    return real(path);
}

int unlink(const char* path) noexcept {
    using Remove = int (*)(const char*);
    static const auto real = shapedb::reliability::libraryFunction<Remove>("unlink");
    if (Disk* const disk = shapedb::reliability::diskAt(path)) disk->removed(path);
    return real(path);
}
}
