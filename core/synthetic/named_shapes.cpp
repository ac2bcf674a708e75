// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/named_shapes.h"

#include <cmath>

#include "core/base/math.h"
#include "core/synthetic/parts.h"

namespace shapedb {

namespace {

double ballVolume(double radius) { return 4.0 / 3.0 * kPi * radius * radius * radius; }

// The volume that a rod between the centres of two balls adds to them: the cylinder between the circles where
// it leaves the balls, less their caps that reach into it.
double rodBetweenBalls(double rodRadius, double gap, double radiusA, double radiusB) {
    double volume = kPi * rodRadius * rodRadius * gap;
    for (const double radius : {radiusA, radiusB}) {
        const double circle = std::sqrt(radius * radius - rodRadius * rodRadius);
        const double cap = radius - circle;
        volume -= kPi * rodRadius * rodRadius * circle;
        volume -= kPi * cap * cap * (3.0 * radius - cap) / 3.0;
    }
    return volume;
}

}  // namespace

double KnownBall::volume() const { return ballVolume(radius); }

NamedShape makeSphere() {
    const double radius = 1.0;
    return {"sphere", {{ball({}, radius)}}, ballVolume(radius), {{{}, radius}}};
}

NamedShape makeTorus() {
    const double ringRadius = 1.0;
    const double tubeRadius = 0.35;
    return {"torus",
            {{ring({}, {0.0, 0.0, 1.0}, ringRadius, tubeRadius)}},
            2.0 * kPi * kPi * ringRadius * tubeRadius * tubeRadius,
            {}};
}

NamedShape makeBox() {
    const Point3 half{1.0, 0.7, 0.5};
    return {"box", {{block({}, half)}}, 8.0 * half.x * half.y * half.z, {}};
}

NamedShape makeLShape() {
    const double halfHeight = 0.4;
    const SolidPart foot = block({0.0, -0.5, 0.0}, {1.0, 0.5, halfHeight});
    const SolidPart stem = block({-0.5, 0.5, 0.0}, {0.5, 0.5, halfHeight});
    return {"l_shape", {{foot, stem}}, 3.0 * 2.0 * halfHeight, {}};
}

NamedShape makeDumbbell() {
    const Point3 left{-1.5, 0.0, 0.0};
    const Point3 right{1.5, 0.0, 0.0};
    const double rodRadius = 0.3;
    return {"dumbbell",
            {{ball(left, 1.0), ball(right, 1.0), cylinder(left, right, rodRadius)}},
            2.0 * ballVolume(1.0) + rodBetweenBalls(rodRadius, distance(left, right), 1.0, 1.0),
            {{left, 1.0}, {right, 1.0}}};
}

NamedShape makeJack() {
    const double centreRadius = 0.8;
    const double endRadius = 0.6;
    const double armRadius = 0.25;
    const double reach = 2.4;
    NamedShape jack{"jack", {{ball({}, centreRadius)}}, ballVolume(centreRadius), {{{}, centreRadius}}};
    const Point3 axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (const Point3& axis : axes) {
        const Point3 end = reach * axis;
        jack.solid.parts.push_back(cylinder({}, end, armRadius));
        jack.solid.parts.push_back(ball(end, endRadius));
        jack.volume += ballVolume(endRadius) + rodBetweenBalls(armRadius, reach, centreRadius, endRadius);
        jack.balls.push_back({end, endRadius});
    }
    return jack;
}

std::vector<NamedShape> namedShapes() {
    return {makeSphere(), makeTorus(), makeBox(), makeLShape(), makeDumbbell(), makeJack()};
}

}  // namespace shapedb
