// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/files/temporary_file.h"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <stdlib.h>

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

}  // namespace shapedb::files
