// Work nobody waits for at this moment must not slow down calls that somebody does.
#pragma once

#include <functional>

namespace shapedb::ingest {

/// Lowers the calling thread's share of the processors for the rest of its life: beside one thread that
/// answers a call it gets about a tenth of a processor both want, and all of it when nobody else does.
/// Best effort: where the system refuses, everything goes on as before.
void becomeBackgroundThread() noexcept;

/// Runs `work` on the calling thread alone, also what it would spread over threads: those of the pool are
/// not in the background, and the other workers keep the processors busy.
void onThisThreadAlone(const std::function<void()>& work);

}  // namespace shapedb::ingest
