// SPDX-License-Identifier: GPL-3.0-or-later
// A directory for the files of one test.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include <gtest/gtest.h>

namespace shapedb::testing {

/// Created empty, removed with everything in it when destroyed.
class TemporaryDirectory {
  public:
    TemporaryDirectory() : path_((std::filesystem::temp_directory_path() / "shapedb-test-XXXXXX").string()) {
        if (::mkdtemp(path_.data()) == nullptr) ADD_FAILURE() << "cannot create a directory " << path_;
    }
    ~TemporaryDirectory() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryDirectory(const TemporaryDirectory&) = delete;
    TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }

  private:
    std::string path_;
};

}  // namespace shapedb::testing
