// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/wanted_rows.h"

namespace shapedb {

std::vector<std::uint8_t> wantedRows(const SignatureBlock& block, const Filter& filter,
                                     std::optional<std::int64_t> excludeId) {
    const bool excludes = excludeId && block.id(0) <= *excludeId && *excludeId <= block.id(block.size() - 1);
    if (filter.acceptsAll() && !excludes) return {};
    std::vector<std::uint8_t> wanted(block.size());
    if (filter.asksForKeys()) {
        for (std::size_t row = 0; row < block.size(); ++row) {
            const bool passes = filter.matches(block.metadata(row), block.key(row));
            wanted[row] = passes && !(excludes && block.id(row) == *excludeId) ? 1 : 0;
        }
        return wanted;
    }
    // Rows share metadata, so the filter is asked once for each that occurs.
    constexpr std::uint8_t kUnknown = 2;
    std::vector<std::uint8_t> passes(block.metadataCount(), kUnknown);
    for (std::size_t row = 0; row < block.size(); ++row) {
        std::uint8_t& pass = passes[block.metadataNumber(row)];
        if (pass == kUnknown) pass = filter.matches(block.metadata(row)) ? 1 : 0;
        wanted[row] = excludes && block.id(row) == *excludeId ? 0 : pass;
    }
    return wanted;
}

}  // namespace shapedb
