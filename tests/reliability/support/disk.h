// SPDX-License-Identifier: GPL-3.0-or-later
// A model of one folder on a disk: what was changed in it, and what of that is certain to be there after
// the power fails. A file's bytes are kept by a sync of the file, its name by a sync of the folder.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/random.h"

namespace shapedb::reliability {

/// Which unsynced changes reach the disk when the power fails.
enum class Loss {
    kAllUnsynced,  ///< none
    kRandom,       ///< some, in any order, also parts of a write (sectors of 512 bytes)
};

/// Files of a folder by name.
using Image = std::map<std::string, std::string>;

/// Sees the changes through the VFS (faults.h) and the C library (interpose.cpp) while it lives; one at a
/// time.
class Disk {
  public:
    /// What is in the folder is certain to be there.
    explicit Disk(std::string folder);
    ~Disk();
    Disk(const Disk&) = delete;
    Disk& operator=(const Disk&) = delete;

    /// The one that watches the file's folder; null: none.
    static Disk* of(const std::string& path);
    static Disk* current();

    /// Called before each change and each sync.
    std::function<void()> before;

    /// What a start after a loss of power would find now. `random` decides with kRandom.
    [[nodiscard]] Image afterPowerLoss(Loss loss, Random& random) const;

    // What happens in the folder, told by those who see it.
    void opened(const std::string& path);
    void written(const std::string& path, std::uint64_t offset, const void* data, std::size_t size);
    void truncated(const std::string& path, std::uint64_t size);
    void synced(const std::string& path);
    void syncFailed(const std::string& path);
    void removed(const std::string& path);
    void renamed(const std::string& from, const std::string& to);

  private:
    struct Change {
        bool cut = false;  ///< to `at` bytes; otherwise `bytes` are written there
        std::uint64_t at = 0;
        std::string bytes;
    };
    struct File {
        std::string durable;
        std::vector<Change> pending;
    };
    using FilePtr = std::shared_ptr<File>;
    using Names = std::map<std::string, FilePtr>;
    /// One atomic change of names: null removes.
    using Renaming = std::vector<std::pair<std::string, FilePtr>>;

    void notify() const;
    void rename(Renaming change);
    FilePtr file(const std::string& path);
    static std::string bytesAfter(const File& file, Loss loss, Random& random);
    [[nodiscard]] bool hasMark() const;
    void addMark(Image& image, Loss loss, Random& random) const;

    std::string folder_;
    Names names_;
    Names durableNames_;
    std::vector<Renaming> pendingNames_;
    bool markNamed_ = false;  ///< the name of the file of addMark is certain
};

}  // namespace shapedb::reliability
