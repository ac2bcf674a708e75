// SPDX-License-Identifier: GPL-3.0-or-later
// Input and output that fail at a chosen call, and the VFS that makes them fail.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace shapedb::reliability {

/// What the store asks of the operating system.
enum class Call { kOpen, kDelete, kRead, kWrite, kTruncate, kSync, kSize, kShare, kRename };

enum class FaultKind {
    kNoSpace,     ///< ENOSPC from what may take space
    kIo,          ///< EIO from everything
    kShortWrite,  ///< half of the bytes are written, then EIO
    kSync,        ///< EIO from a sync, and what it should have kept is lost for good
};

/// Process-wide; for one thread.
class Faults {
  public:
    /// The `at`-th call (from 1) to which `kind` can happen fails; with `lasting` those after it too.
    static void arm(FaultKind kind, std::uint64_t at, bool lasting);
    static void disarm();
    /// Whether a call has failed since it was armed.
    static bool fired();
    /// The calls since it was armed to which the fault could happen.
    static std::uint64_t calls();
    /// Asked by whoever is about to make a call: what happens to it; empty: nothing.
    static std::optional<FaultKind> next(Call call);
    /// The errno of the fault.
    static int systemError(FaultKind kind);
};

// A VFS of SQLite around the default one: tells the disk (disk.h) what is written, and lets calls fail
// (faults.h).

/// The default VFS while it lives, for connections opened meanwhile. One at a time.
class FaultVfs {
  public:
    FaultVfs();
    ~FaultVfs();
    FaultVfs(const FaultVfs&) = delete;
    FaultVfs& operator=(const FaultVfs&) = delete;
};

}  // namespace shapedb::reliability
