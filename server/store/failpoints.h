// SPDX-License-Identifier: GPL-3.0-or-later
// Named places at which a test lets the process die. Compiled out, except of the libraries that
// tests/reliability/ builds for itself with SHAPEDB_FAILPOINTS; a test looks for them in the programs.
#pragma once

#ifdef SHAPEDB_FAILPOINTS

namespace shapedb {

/// Defined by the test program. May not return.
void reachFailpoint(const char* name) noexcept;

}  // namespace shapedb

/// Between two steps; the name says which one is done. Each name is used once, and the test that lets the
/// process die at each finds them in the sources.
#define SHAPEDB_FAILPOINT(name) ::shapedb::reachFailpoint("failpoint:" name)

#else

#define SHAPEDB_FAILPOINT(name) static_cast<void>(0)

#endif
