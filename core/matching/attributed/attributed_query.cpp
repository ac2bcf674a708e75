#include "core/matching/attributed/attributed_query.h"

namespace shapedb {

LevelSums joined(const HalfSums& first, const HalfSums& second) {
    LevelSums sums;
    for (std::size_t s = 0; s < kKindsPerHalf; ++s) {
        sums[static_cast<std::size_t>(kFirstHalf[s])] = first[s];
        sums[static_cast<std::size_t>(kSecondHalf[s])] = second[s];
    }
    return sums;
}

LevelSums AttributedQuery::levelSums(const ShapeRow& shape) const {
    HalfSums first;
    difference_.first(shape.firstHalf, 1, &first);
    return joined(first, difference_.second(*shape.secondHalf));
}

}  // namespace shapedb
