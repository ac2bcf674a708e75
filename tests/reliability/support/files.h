// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files, read and written at once, and databases as text.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace shapedb::reliability {

/// Empty when there is none.
inline std::string readFile(const std::string& path) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    std::string bytes(error ? 0 : static_cast<std::size_t>(size), '\0');
    std::ifstream(path, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return bytes;
}

inline void writeFile(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// All rows of all tables of the file, in order, long values as hashes; "cannot read: ..." when it cannot be
/// read. The file may be open.
[[nodiscard]] std::string dumpDatabase(const std::string& path);

/// The first line in which two dumps differ, for messages.
[[nodiscard]] std::string differenceOf(const std::string& actual, const std::string& expected);

}  // namespace shapedb::reliability
