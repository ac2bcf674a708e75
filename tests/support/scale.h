// SPDX-License-Identifier: GPL-3.0-or-later
// How thorough the tests are that can be made as long as one likes.
#pragma once

#include <cstdlib>

namespace shapedb::testing {

/// SHAPEDB_TEST_SCALE, a number of at least 1; 1 by default, as CI runs them. Nightly lanes and people set
/// more.
inline int testScale() {
    const char* text = std::getenv("SHAPEDB_TEST_SCALE");
    const int scale = text != nullptr ? std::atoi(text) : 1;
    return scale > 1 ? scale : 1;
}

}  // namespace shapedb::testing
