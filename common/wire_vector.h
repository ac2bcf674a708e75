// SPDX-License-Identifier: Apache-2.0
// Points of core/ as messages of the API, for client and server alike.
#pragma once

#include "core/geometry/point.h"
#include "shapedb/v1/types.pb.h"

namespace shapedb::wire {

inline void toProto(const Point3& point, v1::Vector3* out) {
    out->set_x(point.x);
    out->set_y(point.y);
    out->set_z(point.z);
}

[[nodiscard]] inline Point3 fromProto(const v1::Vector3& vector) {
    return {vector.x(), vector.y(), vector.z()};
}

}  // namespace shapedb::wire
