// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/families.h"

#include <algorithm>
#include <cmath>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/geometry/motion.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/parts.h"

namespace shapedb {

namespace {

// Rounds differently from toRadians: a change would alter the shapes that known seeds give.
constexpr double degrees(double d) { return d * kPi / 180.0; }

// The point at distance `length` from `from`; `azimuth` turns from x towards y, `elevation` is above the
// ground.
Point3 towards(const Point3& from, double length, double azimuth, double elevation) {
    return from + Point3{length * std::cos(elevation) * std::cos(azimuth),
                         length * std::cos(elevation) * std::sin(azimuth), length * std::sin(elevation)};
}

void addRods(Solid& solid, const std::vector<Point3>& joints, double radius) {
    for (std::size_t i = 1; i < joints.size(); ++i)
        solid.parts.push_back(rod(joints[i - 1], joints[i], radius));
}

// Four legs, a neck that carries a head with a snout, a tail.
Solid makeAnimal(Random& random) {
    const double half = random.uniform(0.34, 0.52);
    const double girth = random.uniform(0.14, 0.21);
    const double legLength = random.uniform(0.32, 0.62);
    const double legRadius = random.uniform(0.05, 0.07);
    const double neckLength = random.uniform(0.18, 0.5);
    const double neckTilt = degrees(random.uniform(25.0, 70.0));
    const double headRadius = random.uniform(0.095, 0.125);
    const double snout = random.uniform(0.1, 0.22);
    const double tail = random.uniform(0.18, 0.5);
    const double tailTilt = degrees(random.uniform(-50.0, 45.0));

    Solid solid;
    solid.parts.push_back(rod({-half, 0.0, 0.0}, {half, 0.0, random.uniform(-0.02, 0.05)}, girth));
    for (const double x : {-0.92 * half, 0.92 * half}) {
        for (const double y : {-0.62 * girth, 0.62 * girth}) {
            const double swing = random.uniform(-0.1, 0.1);
            solid.parts.push_back(rod({x, y, 0.0}, {x + swing, 1.15 * y, -girth - legLength}, legRadius));
        }
    }
    const Point3 shoulder{half + 0.3 * girth, 0.0, 0.4 * girth};
    const Point3 head = towards(shoulder, neckLength, 0.0, neckTilt);
    solid.parts.push_back(rod(shoulder, head, 0.8 * headRadius));
    solid.parts.push_back(ball(head, headRadius));
    solid.parts.push_back(
        rod(head, towards(head, headRadius + snout, 0.0, degrees(-18.0)), 0.62 * headRadius));
    const Point3 rump{-half - 0.5 * girth, 0.0, 0.4 * girth};
    solid.parts.push_back(rod(rump, towards(rump, girth + tail, kPi, tailTilt), 0.043));
    return solid;
}

Solid makeHuman(Random& random) {
    const double torso = random.uniform(0.4, 0.55);
    const double width = random.uniform(0.15, 0.21);
    const double depth = random.uniform(0.105, 0.15);
    const double leg = random.uniform(0.36, 0.46);
    const double arm = random.uniform(0.25, 0.33);
    const double armRadius = random.uniform(0.042, 0.055);

    Solid solid;
    solid.parts.push_back(ellipsoid({0.0, 0.0, 0.5 * torso}, {depth, width, 0.62 * torso}));
    solid.parts.push_back(rod({0.0, -0.55 * width, 0.0}, {0.0, 0.55 * width, 0.0}, 0.95 * depth));
    const double shoulderHeight = 0.9 * torso;
    solid.parts.push_back(rod({0.0, -width, shoulderHeight}, {0.0, width, shoulderHeight}, 0.075));
    const double headRadius = random.uniform(0.095, 0.12);
    const double headHeight = torso + 0.11 + headRadius;
    solid.parts.push_back(rod({0.0, 0.0, shoulderHeight}, {0.0, 0.0, headHeight}, 0.055));
    solid.parts.push_back(
        ellipsoid({0.0, 0.0, headHeight}, {headRadius, 0.88 * headRadius, 1.2 * headRadius}));
    for (const double side : {-1.0, 1.0}) {
        const Point3 shoulder{0.0, side * width, shoulderHeight};
        const double lift = degrees(random.uniform(-75.0, 25.0));
        const Point3 elbow = towards(shoulder, arm, side * kPi / 2.0, lift);
        const Point3 wrist = towards(elbow, 0.9 * arm, side * degrees(random.uniform(45.0, 90.0)),
                                     lift + degrees(random.uniform(0.0, 40.0)));
        addRods(solid, {shoulder, elbow, wrist}, armRadius);
        solid.parts.push_back(ball(wrist, 1.35 * armRadius));
        const Point3 hip{0.0, side * 0.6 * width, 0.0};
        const double spread = random.uniform(0.02, 0.14);
        const double stride = random.uniform(-0.16, 0.16);
        const Point3 knee = hip + Point3{stride, side * spread, -leg};
        const Point3 ankle = knee + Point3{random.uniform(-0.14, 0.02), side * 0.4 * spread, -leg};
        solid.parts.push_back(rod(hip, knee, 1.6 * armRadius));
        solid.parts.push_back(rod(knee, ankle, 1.25 * armRadius));
        solid.parts.push_back(rod(ankle, ankle + Point3{0.17, 0.0, -0.02}, 1.1 * armRadius));
    }
    return solid;
}

// Eight arms of three joints around a tall head.
Solid makeOctopus(Random& random) {
    const double body = random.uniform(0.22, 0.3);
    const double step = random.uniform(0.22, 0.34);
    const double radius = random.uniform(0.07, 0.082);
    const double curl = degrees(random.uniform(10.0, 45.0));
    Solid solid;
    solid.parts.push_back(ellipsoid({0.0, 0.0, 0.55 * body}, {body, body, body * random.uniform(1.15, 1.7)}));
    for (int i = 0; i < 8; ++i) {
        double azimuth = i * kPi / 4.0 + random.uniform(-0.1, 0.1);
        double elevation = degrees(random.uniform(-35.0, -10.0));
        Point3 joint{0.6 * body * std::cos(azimuth), 0.6 * body * std::sin(azimuth), -0.3 * body};
        double thick = radius;
        for (int segment = 0; segment < 3; ++segment) {
            const Point3 next = towards(joint, step, azimuth, elevation);
            solid.parts.push_back(rod(joint, next, thick));
            joint = next;
            azimuth += random.uniform(-0.3, 0.3);
            elevation += curl * random.uniform(0.5, 1.2);
            thick *= 0.93;
        }
    }
    return solid;
}

// In flight: wings out, head and beak in front, a fan of a tail.
Solid makeBird(Random& random) {
    const double half = random.uniform(0.28, 0.42);
    const double girth = random.uniform(0.12, 0.17);
    const double span = random.uniform(0.5, 0.85);
    const double chord = random.uniform(0.13, 0.2);
    const double dihedral = degrees(random.uniform(-15.0, 30.0));
    const double sweep = degrees(random.uniform(-5.0, 28.0));
    const double headRadius = random.uniform(0.085, 0.115);
    Solid solid;
    solid.parts.push_back(ellipsoid({}, {half, girth, girth}));
    for (const double side : {-1.0, 1.0}) {
        const Matrix3 axes = multiply(rotationAboutX(side * dihedral), rotationAboutZ(side * sweep));
        const Point3 centre =
            rotate(axes, {0.0, side * 0.5 * span, 0.0}) + Point3{0.15 * half, 0.0, 0.3 * girth};
        solid.parts.push_back(ellipsoid(centre, {chord, 0.5 * span + 0.6 * girth, 0.052}, axes));
    }
    const Point3 head = towards({0.8 * half, 0.0, 0.0}, girth + random.uniform(0.06, 0.2), 0.0,
                                degrees(random.uniform(15.0, 55.0)));
    solid.parts.push_back(rod({0.6 * half, 0.0, 0.0}, head, 0.8 * headRadius));
    solid.parts.push_back(ball(head, headRadius));
    solid.parts.push_back(
        rod(head, head + Point3{headRadius + random.uniform(0.06, 0.16), 0.0, -0.03}, 0.038));
    const double fan = random.uniform(0.16, 0.24);
    for (const double side : {-1.0, 1.0}) {
        const Matrix3 axes = rotationAboutZ(side * degrees(-16.0));
        const Point3 centre = rotate(axes, {-fan, 0.0, 0.0}) + Point3{-0.8 * half, 0.0, 0.02};
        solid.parts.push_back(ellipsoid(centre, {fan, 0.085, 0.045}, axes));
    }
    return solid;
}

// Flat from side to side, with a forked tail, a back fin and two breast fins.
Solid makeFish(Random& random) {
    const double half = random.uniform(0.42, 0.6);
    const double height = random.uniform(0.16, 0.3);
    const double width = height * random.uniform(0.45, 0.65);
    const double tail = random.uniform(0.17, 0.26);
    const double fork = degrees(random.uniform(32.0, 55.0));
    Solid solid;
    solid.parts.push_back(ellipsoid({}, {half, width, height}));
    const Point3 root{-0.92 * half, 0.0, 0.0};
    solid.parts.push_back(rod({-0.6 * half, 0.0, 0.0}, root, 0.06));
    for (const double side : {-1.0, 1.0}) {
        const Point3 lobe = towards(root, 0.85 * tail, kPi, side * fork);
        solid.parts.push_back(ellipsoid(lobe, {tail, 0.042, 0.09}, rotationAboutY(side * fork)));
        const Point3 breast{0.35 * half, side * (width + 0.06), -0.3 * height};
        solid.parts.push_back(ellipsoid(breast, {0.09, 0.15, 0.035}, rotationAboutX(-side * degrees(25.0))));
    }
    const double fin = random.uniform(0.1, 0.18);
    solid.parts.push_back(ellipsoid({random.uniform(-0.2, 0.05), 0.0, height}, {0.3 * half, 0.04, fin}));
    return solid;
}

Solid makeAirplane(Random& random) {
    const double half = random.uniform(0.65, 0.9);
    const double girth = random.uniform(0.085, 0.125);
    const double span = random.uniform(0.6, 0.95);
    const double chord = random.uniform(0.11, 0.17);
    const double sweep = degrees(random.uniform(0.0, 35.0));
    const double dihedral = degrees(random.uniform(0.0, 8.0));
    const double slab = 0.045;  // half thickness of wings and fins
    const double wingAt = random.uniform(-0.05, 0.2);
    Solid solid;
    solid.parts.push_back(rod({-half, 0.0, 0.0}, {half, 0.0, 0.0}, girth));
    const int enginesPerSide = static_cast<int>(random.below(3));
    const double tailSpan = random.uniform(0.25, 0.36);
    for (const double side : {-1.0, 1.0}) {
        const Matrix3 axes = multiply(rotationAboutX(side * dihedral), rotationAboutZ(side * sweep));
        const Point3 root{wingAt, 0.0, -0.3 * girth};
        solid.parts.push_back(
            block(root + rotate(axes, {0.0, side * 0.5 * span, 0.0}), {chord, 0.5 * span, slab}, axes));
        for (int engine = 1; engine <= enginesPerSide; ++engine) {
            const double at = span * (engine == 1 ? 0.36 : 0.68);
            const Point3 mount = root + rotate(axes, {0.06, side * at, -0.09});
            solid.parts.push_back(
                cylinder(mount - Point3{0.12, 0.0, 0.0}, mount + Point3{0.14, 0.0, 0.0}, 0.065));
        }
        solid.parts.push_back(block(Point3{-half, 0.0, 0.0} + rotate(axes, {0.0, side * 0.5 * tailSpan, 0.0}),
                                    {0.6 * chord, 0.5 * tailSpan, slab}, axes));
    }
    const double fin = random.uniform(0.16, 0.26);
    const Matrix3 lean = rotationAboutY(-0.5 * sweep - degrees(10.0));
    solid.parts.push_back(block(Point3{-half, 0.0, 0.0} + rotate(lean, {0.0, 0.0, 0.5 * (girth + fin)}),
                                {0.65 * chord, slab, 0.5 * (girth + fin)}, lean));
    return solid;
}

// Round or square legs under a rectangular or round top, with or without stretchers.
Solid makeTable(Random& random) {
    const double halfLength = random.uniform(0.45, 0.75);
    const bool round = random.below(3) == 0;
    const double halfWidth = round ? halfLength : halfLength * random.uniform(0.5, 0.95);
    const double height = random.uniform(0.45, 0.9);
    const double slab = random.uniform(0.042, 0.06);
    const double legRadius = random.uniform(0.045, 0.065);
    Solid solid;
    if (round) {
        solid.parts.push_back(cylinder({0.0, 0.0, -slab}, {0.0, 0.0, slab}, halfLength));
    } else {
        solid.parts.push_back(block({}, {halfLength, halfWidth, slab}));
    }
    const double inset = round ? 0.62 : 0.88;
    const double splay = random.uniform(0.0, 0.08);
    const bool squareLegs = random.below(2) == 0;
    for (const double x : {-inset * halfLength, inset * halfLength}) {
        for (const double y : {-inset * halfWidth, inset * halfWidth}) {
            if (squareLegs) {
                solid.parts.push_back(block({x, y, -0.5 * height}, {legRadius, legRadius, 0.5 * height}));
            } else {
                solid.parts.push_back(
                    cylinder({x, y, 0.0}, {x * (1.0 + splay), y * (1.0 + splay), -height}, legRadius));
            }
        }
    }
    if (random.below(2) == 0) {
        const double z = -height * random.uniform(0.6, 0.8);
        for (const double y : {-inset * halfWidth, inset * halfWidth}) {
            solid.parts.push_back(rod({-inset * halfLength, y, z}, {inset * halfLength, y, z}, 0.042));
        }
    }
    return solid;
}

// Seat, four legs and a back of a panel or of posts and rails; sometimes armrests.
Solid makeChair(Random& random) {
    const double half = random.uniform(0.24, 0.32);
    const double legs = random.uniform(0.35, 0.6);
    const double back = random.uniform(0.4, 0.75);
    const double slab = random.uniform(0.03, 0.05);
    const double legRadius = random.uniform(0.032, 0.045);
    const double lean = random.uniform(0.0, 0.12);
    const double inset = half - legRadius;
    Solid solid;
    solid.parts.push_back(block({}, {half, half, slab}));
    for (const double x : {-inset, inset}) {
        for (const double y : {-inset, inset})
            solid.parts.push_back(cylinder({x, y, 0.0}, {1.06 * x, 1.06 * y, -legs}, legRadius));
    }
    const Point3 top{-inset - lean, 0.0, back};
    if (random.below(2) == 0) {
        const double tilt = -std::atan2(lean, back);
        solid.parts.push_back(block({-inset - 0.5 * lean, 0.0, 0.5 * back}, {legRadius, half, 0.5 * back},
                                    rotationAboutY(tilt)));
    } else {
        for (const double y : {-inset, 0.0, inset})
            solid.parts.push_back(rod({-inset, y, 0.0}, {top.x, y, top.z}, legRadius));
        solid.parts.push_back(rod({top.x, -inset, top.z}, {top.x, inset, top.z}, 1.3 * legRadius));
    }
    if (random.below(3) == 0) {
        const double z = 0.42 * back;
        for (const double y : {-inset, inset}) {
            addRods(solid, {{-inset - lean * z / back, y, z}, {0.7 * inset, y, z}, {0.7 * inset, y, 0.0}},
                    legRadius);
        }
    }
    return solid;
}

// A pipe with a floor, and a handle bent from five rods.
Solid makeMug(Random& random) {
    const double radius = random.uniform(0.3, 0.42);
    const double height = random.uniform(0.55, 1.05);
    const double wall = random.uniform(0.085, 0.11);
    const double reach = random.uniform(0.2, 0.34);
    const double halfGrip = height * random.uniform(0.22, 0.33);
    const double grip = random.uniform(0.042, 0.058);
    const double middle = height * random.uniform(0.45, 0.56);
    Solid solid;
    solid.parts.push_back(cylinder({}, {0.0, 0.0, height}, radius, radius - wall));
    solid.parts.push_back(cylinder({}, {0.0, 0.0, 1.2 * wall}, radius - 0.5 * wall));
    // Joints on half an ellipse from wall to wall; the ends stay inside the wall.
    std::vector<Point3> joints;
    for (int i = 0; i <= 8; ++i) {
        const double angle = (i / 8.0 - 0.5) * kPi;
        joints.push_back(
            {radius - 0.3 * wall + reach * std::cos(angle), 0.0, middle + halfGrip * std::sin(angle)});
    }
    addRods(solid, joints, grip);
    return solid;
}

// Body, shoulder, neck and lip.
Solid makeBottle(Random& random) {
    const double radius = random.uniform(0.17, 0.3);
    const double body = random.uniform(0.45, 0.85);
    const double neck = random.uniform(0.2, 0.45);
    const double neckRadius = random.uniform(0.06, 0.09);
    const double shoulder = random.uniform(0.12, 0.3);
    Solid solid;
    solid.parts.push_back(cylinder({}, {0.0, 0.0, body}, radius));
    solid.parts.push_back(ellipsoid({0.0, 0.0, body}, {radius, radius, shoulder}));
    const double top = body + shoulder + neck;
    solid.parts.push_back(cylinder({0.0, 0.0, body}, {0.0, 0.0, top}, neckRadius));
    solid.parts.push_back(
        cylinder({0.0, 0.0, top - 0.07}, {0.0, 0.0, top}, neckRadius + random.uniform(0.02, 0.045)));
    return solid;
}

// A handle and across its end a head: two faces, a face and a claw, or a face and a ball.
Solid makeHammer(Random& random) {
    const double handle = random.uniform(0.8, 1.25);
    const double handleRadius = random.uniform(0.045, 0.062);
    const double headRadius = random.uniform(0.085, 0.13);
    const double half = random.uniform(0.18, 0.3);
    Solid solid;
    solid.parts.push_back(cylinder({}, {0.0, 0.0, handle}, handleRadius));
    solid.parts.push_back(rod({}, {0.0, 0.0, 0.4 * handle}, handleRadius * random.uniform(1.15, 1.4)));
    const double z = handle - 0.6 * headRadius;
    solid.parts.push_back(block({0.0, 0.0, z}, {0.5 * half, 0.8 * headRadius, 0.8 * headRadius}));
    solid.parts.push_back(cylinder({}, {half, 0.0, 0.0}, headRadius));
    solid.parts.back().placement.translation.z = z;
    switch (random.below(3)) {
        case 0: solid.parts.push_back(cylinder({-half, 0.0, z}, {0.0, 0.0, z}, headRadius)); break;
        case 1:
            for (const double side : {-1.0, 1.0}) {
                addRods(solid,
                        {{-0.3 * half, side * 0.4 * headRadius, z},
                         {-0.8 * half, side * 0.6 * headRadius, z + 0.01},
                         {-1.35 * half, side * 0.85 * headRadius, z - 0.09}},
                        0.04);
            }
            break;
        default:
            solid.parts.push_back(rod({-0.85 * half, 0.0, z}, {0.0, 0.0, z}, 0.65 * headRadius));
            solid.parts.push_back(ball({-half, 0.0, z}, 0.95 * headRadius));
    }
    return solid;
}

// A flat bowl at the end of a bent handle.
Solid makeSpoon(Random& random) {
    const double handle = random.uniform(0.6, 1.0);
    const double bend = random.uniform(0.03, 0.14);
    const double radius = random.uniform(0.032, 0.042);
    const double bowl = random.uniform(0.16, 0.26);
    const double bowlWidth = bowl * random.uniform(0.6, 0.85);
    Solid solid;
    solid.parts.push_back(ellipsoid({-0.9 * bowl, 0.0, 0.0}, {bowl, bowlWidth, random.uniform(0.05, 0.08)}));
    std::vector<Point3> joints;
    for (int i = 0; i <= 6; ++i) {
        const double t = i / 6.0;
        joints.push_back({-0.25 * bowl + t * (handle + 0.25 * bowl), 0.0, bend * std::sin(kPi * t)});
    }
    addRods(solid, joints, radius);
    const double end = random.uniform(0.05, 0.08);
    solid.parts.push_back(ellipsoid({handle, 0.0, 0.0}, {1.6 * end, end, 1.1 * radius}));
    return solid;
}

// Two weights on a bar: balls, discs or pairs of discs, sometimes unequal.
Solid makeDumbbell(Random& random) {
    const double half = random.uniform(0.4, 0.75);
    const double bar = random.uniform(0.055, 0.1);
    const double radius = random.uniform(0.2, 0.36);
    const double other = random.below(3) == 0 ? radius * random.uniform(0.65, 0.9) : radius;
    const bool discs = random.below(2) == 0;
    const double thick = random.uniform(0.07, 0.13);
    Solid solid;
    solid.parts.push_back(cylinder({-half, 0.0, 0.0}, {half, 0.0, 0.0}, bar));
    for (const double side : {-1.0, 1.0}) {
        const double own = side < 0.0 ? radius : other;
        if (discs) {
            solid.parts.push_back(
                cylinder({side * (half - thick), 0.0, 0.0}, {side * (half + thick), 0.0, 0.0}, own));
        } else {
            solid.parts.push_back(ball({side * half, 0.0, 0.0}, own));
        }
    }
    return solid;
}

struct Family {
    const char* name;
    const char* description;
    Solid (*make)(Random&);
};

constexpr Family kFamilies[] = {
    {"airplane", "fuselage with wings, tail planes and up to four engines", makeAirplane},
    {"animal", "four legs, body, neck, head with a snout, tail", makeAnimal},
    {"bird", "in flight: body, two wings, head with a beak, tail", makeBird},
    {"bottle", "round body, shoulder, neck and lip", makeBottle},
    {"chair", "seat on four legs with a back, sometimes armrests", makeChair},
    {"dumbbell", "two balls or discs on a bar", makeDumbbell},
    {"fish", "body with a forked tail, back fin and breast fins", makeFish},
    {"hammer", "handle with a head across its end", makeHammer},
    {"human", "standing figure with head, arms and legs in varied poses", makeHuman},
    {"mug", "open cup with one handle", makeMug},
    {"octopus", "head with eight jointed arms", makeOctopus},
    {"spoon", "bowl on a bent handle", makeSpoon},
    {"table", "rectangular or round top on four legs", makeTable},
};

// One stream per family (FNV-1a of the name), index and seed: adding families shifts nothing, and
// neighbouring members and seeds have nothing in common.
std::uint64_t memberSeed(const std::string& family, std::size_t index, std::uint64_t seed) {
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    for (const char c : family) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    return Random(Random(Random(seed).next() ^ hash).next() ^ index).next();
}

Motion randomPose(Random& random, double diagonal) {
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = std::pow(10.0, random.uniform(-1.0, 1.0));
    const double range = 10.0 * diagonal * motion.scale;
    motion.translation = {random.uniform(-range, range), random.uniform(-range, range),
                          random.uniform(-range, range)};
    return motion;
}

}  // namespace

std::vector<FamilyInfo> listFamilies() {
    std::vector<FamilyInfo> families;
    for (const Family& family : kFamilies) families.push_back({family.name, family.description});
    return families;
}

Result<Solid> makeMember(const std::string& family, std::size_t index, std::uint64_t seed) {
    std::string names;
    for (const Family& known : kFamilies) {
        if (family == known.name) {
            Random random(memberSeed(family, index, seed));
            return known.make(random);
        }
        names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    return fail(ErrorCode::kInvalidArgument,
                "there is no family \"" + family + "\"; known families: " + names);
}

Result<PointCloud> scanOf(const Solid& solid, const ScanOptions& options) {
    // Three streams, so that the number of points and the noise do not influence the rest.
    Random seeds(options.seed);
    const std::uint64_t pointSeed = seeds.next();
    const std::uint64_t noiseSeed = seeds.next();
    Random poseRandom(seeds.next());

    auto points = sampleBoundary(solid, options.count, pointSeed);
    RETURN_IF_ERROR(points);
    RETURN_IF_ERROR(addGaussianNoise(*points, options.noise, noiseSeed));
    if (!options.randomPose) return points;
    return applyToCloud(randomPose(poseRandom, boundsOf(solid).diagonal()), *points);
}

}  // namespace shapedb
