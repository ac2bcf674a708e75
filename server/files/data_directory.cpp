// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/files/data_directory.h"

#include <cerrno>
#include <filesystem>
#include <optional>
#include <system_error>
#include <vector>

#include <sys/stat.h>

#include "core/base/return_if_error.h"
#include "server/files/directory_handle.h"
#include "server/files/temporary_file.h"

namespace shapedb::files {

namespace {

bool startsWith(const std::string& text, const std::string& prefix) {
    return text.compare(0, prefix.size(), prefix) == 0;
}

/// The root of a file system of its own has this directory from the start.
bool comesWithTheFileSystem(const std::string& name) { return name == "lost+found"; }

/// Removes the files that a TemporaryFile had, and its folder if nothing else is in it.
void removeRemains(const DirectoryHandle& directory, const std::string& name) {
    const auto folder = directory.openInside(name);
    if (!folder || !folder->isOurs()) return;
    std::vector<std::string> files;
    static_cast<void>(folder->forEach([&](const std::string& file) {
        if (startsWith(file, TemporaryFile::kFileName)) files.push_back(file);
        return true;
    }));
    for (const std::string& file : files) folder->removeFile(file);
    directory.removeEmptyDirectory(name);
}

}  // namespace

Result<void> prepareDataDirectory(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code error;
    if (fs::create_directories(path, error)) {
        fs::permissions(path, fs::perms::owner_all, error);
    }
    if (!error && !fs::is_directory(path)) error = std::make_error_code(std::errc::not_a_directory);
    if (error) {
        return fail(ErrorCode::kFileNotWritable,
                    "data directory " + path + " cannot be created: " + error.message());
    }
    // The operator may name it by a link; what is inside is never reached through one. The name after the
    // link ends with a slash, which follows it.
    const auto directory = DirectoryHandle::open(path + "/.");
    RETURN_IF_ERROR(directory);
    bool ours = false;
    std::optional<std::string> foreign;
    RETURN_IF_ERROR(directory->forEach([&](const std::string& name) {
        ours = ours || startsWith(name, kDatabaseName) || startsWith(name, kKeysName);
        if (!comesWithTheFileSystem(name)) foreign = name;
        return !ours;
    }));
    if (ours || !foreign) return {};
    return fail(ErrorCode::kFileNotWritable, "data directory " + path + " holds '" + *foreign +
                                                 "' but no ShapeDB database: name an empty directory, one "
                                                 "that does not exist yet, or one that ShapeDB has used");
}

Result<void> prepareTemporaryDirectory(const std::string& path) {
    if (::mkdir(path.c_str(), S_IRWXU) != 0 && errno != EEXIST) {
        return fail(ErrorCode::kFileNotWritable,
                    "directory " + path + " cannot be created: " + std::generic_category().message(errno));
    }
    const auto directory = DirectoryHandle::open(path);
    RETURN_IF_ERROR(directory);
    if (!directory->isOurs()) {
        return fail(ErrorCode::kFileNotWritable, "directory " + path + " belongs to another user");
    }
    RETURN_IF_ERROR(directory->makePrivate());
    std::vector<std::string> remains;
    RETURN_IF_ERROR(directory->forEach([&](const std::string& name) {
        if (startsWith(name, TemporaryFile::kFolderPrefix)) remains.push_back(name);
        return true;
    }));
    for (const std::string& name : remains) removeRemains(*directory, name);
    return {};
}

}  // namespace shapedb::files
