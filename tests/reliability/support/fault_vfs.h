// SPDX-License-Identifier: GPL-3.0-or-later
// A VFS of SQLite around the default one: tells the disk (disk.h) what is written, and lets calls fail
// (faults.h).
#pragma once

namespace shapedb::reliability {

/// The default VFS while it lives, for connections opened meanwhile. One at a time.
class FaultVfs {
  public:
    FaultVfs();
    ~FaultVfs();
    FaultVfs(const FaultVfs&) = delete;
    FaultVfs& operator=(const FaultVfs&) = delete;
};

}  // namespace shapedb::reliability
