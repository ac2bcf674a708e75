// SPDX-License-Identifier: Apache-2.0
#include "common/nearest_name.h"

#include <algorithm>

namespace shapedb {

namespace {

/// Insertions, deletions, replacements and swaps of neighbours that make one word the other.
std::size_t editDistance(const std::string& a, const std::string& b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
    for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replaced});
            const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    }
    return d[a.size()][b.size()];
}

}  // namespace

std::string nearestName(const std::string& typed, const std::vector<std::string>& names) {
    std::string best;
    std::size_t least = std::max<std::size_t>(1, typed.size() / 3) + 1;
    for (const std::string& name : names) {
        const std::size_t distance = editDistance(typed, name);
        if (distance >= least) continue;
        least = distance;
        best = name;
    }
    if (!best.empty() || typed.size() < 3) return best;
    // Only begun, as in --thresh.
    const auto begun = std::find_if(names.begin(), names.end(),
                                    [&](const std::string& name) { return name.rfind(typed, 0) == 0; });
    return begun == names.end() ? std::string() : *begun;
}

std::string didYouMean(const std::string& name) {
    return name.empty() ? "" : ": did you mean '" + name + "'?";
}

std::string unknownOption(const std::string& word, const std::vector<std::string>& flags) {
    const std::string flag = word.substr(0, word.find('='));
    return "unknown option '" + flag + "'" + didYouMean(nearestName(flag, flags));
}

}  // namespace shapedb
