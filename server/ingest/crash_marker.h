// SPDX-License-Identifier: GPL-3.0-or-later
// Tells a crash of the segmentation from a kill, a power failure or a crash elsewhere.
//
// A process that is killed says nothing; one that crashes runs a signal handler. The handler writes which
// scan the crashing thread was segmenting, so that after a restart only that scan is a suspect.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/store/store.h"

namespace shapedb::ingest {

/// Reads what a crashed process left in the file `path`, empties it and installs the handlers of SIGSEGV,
/// SIGBUS, SIGFPE, SIGILL and SIGABRT, which end the process as before. The file is private to its owner, not
/// a link, and stays open: a signal handler may open none. Call once in a process, before threads segment.
/// Errors: kFileNotWritable.
[[nodiscard]] Result<std::vector<store::Crash>> installCrashMarker(const std::string& path);

/// While it lives, a crash of this thread is put down to the scan. Gives the thread a signal stack of its
/// own, so that an overflow of the stack is noticed too. Does nothing without an installed marker.
class InHand {
  public:
    InHand(std::int64_t shapeId, std::int64_t pointsVersion);
    ~InHand();
    InHand(const InHand&) = delete;
    InHand& operator=(const InHand&) = delete;
};

}  // namespace shapedb::ingest
