// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/explanation.h"

#include <utility>

namespace shapedb {

namespace {

std::vector<std::uint32_t> missing(std::size_t count, const std::vector<PointMatch>& matches,
                                   std::uint32_t PointMatch::*side) {
    std::vector<bool> seen(count, false);
    for (const PointMatch& match : matches) seen[match.*side] = true;
    std::vector<std::uint32_t> rest;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (!seen[i]) rest.push_back(i);
    }
    return rest;
}

}  // namespace

void listUnmatched(Explanation& explanation, std::size_t countA, std::size_t countB) {
    explanation.unmatchedA = missing(countA, explanation.matches, &PointMatch::a);
    explanation.unmatchedB = missing(countB, explanation.matches, &PointMatch::b);
}

void setMotion(const Motion& motion, const Signature& a, const Signature& b, Explanation& explanation) {
    explanation.motion = motion;
    for (PointMatch& match : explanation.matches) {
        const Point3 there = apply(motion, pointPosition(b, match.b));
        match.distance = length(pointPosition(a, match.a) - there) / a.scale;
    }
}

Explanation exchanged(Explanation explanation, double unit) {
    explanation.motion = inverse(explanation.motion);
    for (PointMatch& match : explanation.matches) {
        std::swap(match.a, match.b);
        match.distance *= unit;
    }
    std::swap(explanation.unmatchedA, explanation.unmatchedB);
    return explanation;
}

}  // namespace shapedb
