// Work nobody waits for at this moment must not slow down calls that somebody does.
#pragma once

namespace shapedb::ingest {

/// Lowers the calling thread's share of the processors for the rest of its life: beside one thread that
/// answers a call it gets about a tenth of a processor both want, and all of it when nobody else does.
/// Best effort: where the system refuses, everything goes on as before.
void becomeBackgroundThread() noexcept;

}  // namespace shapedb::ingest
