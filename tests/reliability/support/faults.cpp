// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/faults.h"

#include <cerrno>
#include <string>

#include <sqlite3.h>

#include "tests/reliability/support/disk.h"

namespace shapedb::reliability {

namespace {

struct Plan {
    bool armed = false;
    FaultKind kind = FaultKind::kIo;
    std::uint64_t at = 0;
    bool lasting = false;
    std::uint64_t calls = 0;
    bool fired = false;
};
Plan plan;

bool canHappen(FaultKind kind, Call call) {
    switch (kind) {
        case FaultKind::kIo: return true;
        case FaultKind::kShortWrite: return call == Call::kWrite;
        case FaultKind::kSync: return call == Call::kSync;
        case FaultKind::kNoSpace:
            return call == Call::kOpen || call == Call::kWrite || call == Call::kTruncate ||
                   call == Call::kSync || call == Call::kShare || call == Call::kRename;
    }
    return false;
}

}  // namespace

void Faults::arm(FaultKind kind, std::uint64_t at, bool lasting) {
    plan = Plan{true, kind, at, lasting, 0, false};
}

void Faults::disarm() { plan.armed = false; }

bool Faults::fired() { return plan.fired; }

std::uint64_t Faults::calls() { return plan.calls; }

std::optional<FaultKind> Faults::next(Call call) {
    if (!plan.armed || !canHappen(plan.kind, call)) return {};
    ++plan.calls;
    if (plan.calls != plan.at && !(plan.lasting && plan.fired)) return {};
    plan.fired = true;
    return plan.kind;
}

int Faults::systemError(FaultKind kind) { return kind == FaultKind::kNoSpace ? ENOSPC : EIO; }

namespace {

sqlite3_vfs* realVfs = nullptr;
sqlite3_vfs shim;

/// The real file is behind this in the memory that SQLite gives.
struct ShimFile {
    sqlite3_file base;
    std::string* path;  // null: a temporary file
    int lastError;
};

ShimFile& own(sqlite3_file* file) { return *reinterpret_cast<ShimFile*>(file); }

sqlite3_file* real(sqlite3_file* file) {
    return reinterpret_cast<sqlite3_file*>(reinterpret_cast<char*>(file) + sizeof(ShimFile));
}

Disk* diskOf(sqlite3_file* file) { return own(file).path != nullptr ? Disk::of(*own(file).path) : nullptr; }

/// The code with which the call fails; SQLITE_OK: it does not. As the default VFS translates errno.
int failing(sqlite3_file* file, Call call, int code) {
    const auto fault = Faults::next(call);
    if (!fault) return SQLITE_OK;
    // The default VFS answers with errno when SQLite asks why a call failed.
    errno = Faults::systemError(*fault);
    if (file != nullptr) own(file).lastError = errno;
    if (*fault == FaultKind::kNoSpace && call == Call::kWrite) return SQLITE_FULL;
    return code;
}

int closeFile(sqlite3_file* file) {
    const int code = real(file)->pMethods->xClose(real(file));
    delete own(file).path;
    own(file).path = nullptr;
    return code;
}

int readShim(sqlite3_file* file, void* data, int size, sqlite3_int64 offset) {
    if (const int code = failing(file, Call::kRead, SQLITE_IOERR_READ)) return code;
    return real(file)->pMethods->xRead(real(file), data, size, offset);
}

int writeShim(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
    const int fault = failing(file, Call::kWrite, SQLITE_IOERR_WRITE);
    // A write that fails may have written a part: always does here, which also covers the short ones.
    const int written = fault == SQLITE_OK ? size : size / 2;
    Disk* const disk = diskOf(file);
    if (disk != nullptr && written > 0)
        disk->written(*own(file).path, static_cast<std::uint64_t>(offset), data,
                      static_cast<std::size_t>(written));
    const int code =
        written > 0 ? real(file)->pMethods->xWrite(real(file), data, written, offset) : SQLITE_OK;
    return fault != SQLITE_OK ? fault : code;
}

int truncateFile(sqlite3_file* file, sqlite3_int64 size) {
    if (const int code = failing(file, Call::kTruncate, SQLITE_IOERR_TRUNCATE)) return code;
    if (Disk* const disk = diskOf(file)) disk->truncated(*own(file).path, static_cast<std::uint64_t>(size));
    return real(file)->pMethods->xTruncate(real(file), size);
}

// What a sync keeps is seen in the C library (interpose.cpp): the file, and its folder where SQLite syncs it.
int syncFile(sqlite3_file* file, int flags) {
    if (const int code = failing(file, Call::kSync, SQLITE_IOERR_FSYNC)) {
        if (Disk* const disk = diskOf(file)) disk->syncFailed(*own(file).path);
        return code;
    }
    return real(file)->pMethods->xSync(real(file), flags);
}

int sizeOfFile(sqlite3_file* file, sqlite3_int64* size) {
    if (const int code = failing(file, Call::kSize, SQLITE_IOERR_FSTAT)) return code;
    return real(file)->pMethods->xFileSize(real(file), size);
}

int lockFile(sqlite3_file* file, int lock) { return real(file)->pMethods->xLock(real(file), lock); }
int unlockFile(sqlite3_file* file, int lock) { return real(file)->pMethods->xUnlock(real(file), lock); }
int checkLock(sqlite3_file* file, int* out) {
    return real(file)->pMethods->xCheckReservedLock(real(file), out);
}

int controlFile(sqlite3_file* file, int operation, void* argument) {
    if (operation == SQLITE_FCNTL_LAST_ERRNO && own(file).lastError != 0) {
        *static_cast<int*>(argument) = own(file).lastError;
        return SQLITE_OK;
    }
    return real(file)->pMethods->xFileControl(real(file), operation, argument);
}

int sectorSize(sqlite3_file* file) { return real(file)->pMethods->xSectorSize(real(file)); }
int characteristics(sqlite3_file* file) { return real(file)->pMethods->xDeviceCharacteristics(real(file)); }

int mapShared(sqlite3_file* file, int page, int size, int extend, void volatile** out) {
    if (const int code = failing(file, Call::kShare, SQLITE_IOERR_SHMSIZE)) return code;
    return real(file)->pMethods->xShmMap(real(file), page, size, extend, out);
}
int lockShared(sqlite3_file* file, int offset, int count, int flags) {
    return real(file)->pMethods->xShmLock(real(file), offset, count, flags);
}
void barrier(sqlite3_file* file) { real(file)->pMethods->xShmBarrier(real(file)); }
int unmapShared(sqlite3_file* file, int remove) {
    return real(file)->pMethods->xShmUnmap(real(file), remove);
}

constexpr sqlite3_io_methods kMethods = {
    2,          closeFile,  readShim,    writeShim,   truncateFile, syncFile,        sizeOfFile,
    lockFile,   unlockFile, checkLock,   controlFile, sectorSize,   characteristics, mapShared,
    lockShared, barrier,    unmapShared, nullptr,     nullptr,
};

int openFile(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* outFlags) {
    own(file) = ShimFile{};
    if (const int code = failing(nullptr, Call::kOpen, SQLITE_CANTOPEN)) return code;
    const int code = realVfs->xOpen(realVfs, name, real(file), flags, outFlags);
    if (code != SQLITE_OK) return code;
    if (name != nullptr) {
        own(file).path = new std::string(name);
        if (Disk* const disk = diskOf(file)) disk->opened(name);
    }
    own(file).base.pMethods = &kMethods;
    return SQLITE_OK;
}

int deleteFile(sqlite3_vfs*, const char* name, int syncFolder) {
    if (const int code = failing(nullptr, Call::kDelete, SQLITE_IOERR_DELETE)) return code;
    return realVfs->xDelete(realVfs, name, syncFolder);
}

}  // namespace

FaultVfs::FaultVfs() {
    realVfs = sqlite3_vfs_find(nullptr);
    shim = *realVfs;
    shim.zName = "shapedb-faults";
    shim.szOsFile = static_cast<int>(sizeof(ShimFile)) + realVfs->szOsFile;
    shim.xOpen = openFile;
    shim.xDelete = deleteFile;
    shim.pNext = nullptr;
    sqlite3_vfs_register(&shim, 1);
}

FaultVfs::~FaultVfs() {
    sqlite3_vfs_register(realVfs, 1);
    sqlite3_vfs_unregister(&shim);
    Faults::disarm();
}

}  // namespace shapedb::reliability
