// SPDX-License-Identifier: GPL-3.0-or-later
// An open directory: its entries are reached through it, so that no symbolic link put in the way is followed.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "core/base/error.h"

namespace shapedb::files {

/// Move-only; closes the directory when destroyed.
class DirectoryHandle {
  public:
    /// `path` itself must not be a link. Errors: kFileNotWritable (missing, a link, no directory, not
    /// permitted).
    [[nodiscard]] static Result<DirectoryHandle> open(const std::string& path);
    ~DirectoryHandle();
    DirectoryHandle(DirectoryHandle&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    DirectoryHandle& operator=(DirectoryHandle&&) = delete;

    /// A directory inside this one, not through a link. Errors: as `open`.
    [[nodiscard]] Result<DirectoryHandle> openInside(const std::string& name) const;
    /// Calls `visit` with the name of each entry except . and .. until it returns false. Errors:
    /// kFileNotReadable.
    [[nodiscard]] Result<void> forEach(const std::function<bool(const std::string&)>& visit) const;
    /// Whether it belongs to the user of this process.
    [[nodiscard]] bool isOurs() const;
    /// Nobody but the owner may look inside. Errors: kFileNotWritable.
    [[nodiscard]] Result<void> makePrivate() const;
    /// Removes a file (a link itself, not what it points to) or an empty directory. False if it cannot be
    /// removed.
    bool removeFile(const std::string& name) const;
    bool removeEmptyDirectory(const std::string& name) const;

  private:
    explicit DirectoryHandle(int descriptor) : descriptor_(descriptor) {}

    int descriptor_;
};

}  // namespace shapedb::files
