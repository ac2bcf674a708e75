#include "core/matching/attributed/attributed_query.h"

namespace shapedb {

LevelSums AttributedQuery::levelSums(const ShapeRow& shape) const {
    HalfSums first;
    difference_.first(shape.firstHalf, 1, &first);
    return joined(first, difference_.second(*shape.secondHalf));
}

}  // namespace shapedb
