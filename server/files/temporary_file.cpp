// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/files/temporary_file.h"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <stdlib.h>
#include <sys/statvfs.h>

namespace shapedb::files {

Result<TemporaryFile> TemporaryFile::create(const std::string& directory) {
    std::string folder = directory + "/" + kFolderPrefix + "XXXXXX";
    if (::mkdtemp(folder.data()) == nullptr) {
        return fail(ErrorCode::kFileNotWritable, "cannot create a temporary file in " + directory + ": " +
                                                     std::generic_category().message(errno));
    }
    return TemporaryFile(std::move(folder));
}

TemporaryFile::~TemporaryFile() {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept : folder_(std::exchange(other.folder_, {})) {}

Result<void> requireFreeSpace(const std::string& directory, std::uint64_t bytes, const std::string& what) {
    struct statvfs status {};
    if (::statvfs(directory.c_str(), &status) != 0) return {};
    const auto block = static_cast<std::uint64_t>(status.f_frsize);
    const std::uint64_t free = static_cast<std::uint64_t>(status.f_bavail) * block;
    const std::uint64_t usable = free > kLeftToDatabase ? free - kLeftToDatabase : 0;
    if (bytes <= usable) return {};
    return fail(ErrorCode::kStorageFull, what + " needs " + std::to_string(bytes) + " bytes of disk, " +
                                             std::to_string(usable) + " are free for it");
}

}  // namespace shapedb::files
