// SPDX-License-Identifier: GPL-3.0-or-later
// Background work must not slow down the calls that clients wait for.
#pragma once

#include <functional>

namespace shapedb::ingest {

/// Lowers the priority of the calling thread for the rest of its life: beside a thread that answers a
/// call it gets about a tenth of a processor both want, and all of it otherwise. Best effort.
void becomeBackgroundThread() noexcept;

/// Runs `work` on the calling thread alone, including its parallel loops.
void onThisThreadAlone(const std::function<void()>& work);

}  // namespace shapedb::ingest
