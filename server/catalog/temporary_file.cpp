#include "server/catalog/temporary_file.h"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <stdlib.h>

namespace shapedb::catalog {

Result<TemporaryFile> TemporaryFile::create(const std::string& directory) {
    std::string folder = directory + "/XXXXXX";
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

Result<void> prepareTemporaryDirectory(const std::string& directory) {
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    std::filesystem::directory_iterator at(directory, error);
    for (; !error && at != std::filesystem::directory_iterator(); at.increment(error)) {
        std::filesystem::remove_all(at->path(), error);
        if (error) break;
    }
    if (error) {
        return fail(ErrorCode::kFileNotWritable,
                    "directory " + directory + " cannot be prepared: " + error.message());
    }
    return {};
}

}  // namespace shapedb::catalog
