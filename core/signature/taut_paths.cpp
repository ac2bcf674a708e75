// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/taut_paths.h"

#include <algorithm>
#include <functional>

namespace shapedb {

namespace {

constexpr int kHalvings = 3;  // of the way from a cell's centre to where the path would be straight

// The point of the line from a to b nearest to p.
Point3 nearestOnLine(const Point3& a, const Point3& b, const Point3& p) {
    const Point3 way = b - a;
    const double square = dot(way, way);
    const double t = square > 0.0 ? std::clamp(dot(p - a, way) / square, 0.0, 1.0) : 0.0;
    return a + t * way;
}

}  // namespace

TautPaths::TautPaths(const InteriorGrid& grid, const CellGraph& graph, const PointCloud& centres)
    : grid_(grid), graph_(graph), centres_(centres) {}

std::vector<double> TautPaths::from(std::uint32_t source, double unreached) {
    turns_.assign(1, {centres_[source], 0.0});
    states_.assign(centres_.size(), {unreached, 0, State::kUnknown});
    open_.clear();
    put(source, 0.0, 0, true);
    while (!open_.empty()) {
        std::pop_heap(open_.begin(), open_.end(), std::greater<>());
        const auto [length, cell] = open_.back();
        open_.pop_back();
        State& state = states_[cell];
        if (state.stage == State::kDone || length != state.length) continue;
        if (state.stage == State::kTentative && !grid_.sees(turns_[state.turn].at, centres_[cell])) {
            // Longer than it was, so that others may come first now.
            turnTowards(cell);
            continue;
        }
        state.stage = State::kDone;
        relax(cell);
    }
    std::vector<double> lengths;
    lengths.reserve(states_.size());
    for (const State& state : states_) lengths.push_back(state.length);
    return lengths;
}

void TautPaths::put(std::uint32_t cell, double length, std::uint32_t turn, bool seen) {
    states_[cell] = {length, turn, seen ? State::kSeen : State::kTentative};
    open_.emplace_back(length, cell);
    std::push_heap(open_.begin(), open_.end(), std::greater<>());
}

double TautPaths::lengthVia(std::uint32_t turn, std::uint32_t cell) const {
    return turns_[turn].length + distance(turns_[turn].at, centres_[cell]);
}

// Supposes that the neighbours see what the cell sees; whether they do is looked at when their turn comes.
void TautPaths::relax(std::uint32_t cell) {
    const std::uint32_t turn = states_[cell].turn;
    for (std::uint32_t e = graph_.begin[cell]; e < graph_.begin[cell + 1]; ++e) {
        const std::uint32_t next = graph_.neighbours[e];
        if (states_[next].stage == State::kDone) continue;
        const double length = lengthVia(turn, next);
        if (length < states_[next].length) put(next, length, turn, false);
    }
}

// The shortest way through a neighbour that was reached: from the last turn of its path if the cell sees
// that, or round a turn of its own.
void TautPaths::turnTowards(std::uint32_t cell) {
    const std::uint32_t refused = states_[cell].turn;
    const Point3& centre = centres_[cell];
    std::uint32_t bend = cell;
    double throughBend = 0.0;
    std::uint32_t turn = refused;
    double length = 0.0;
    for (std::uint32_t e = graph_.begin[cell]; e < graph_.begin[cell + 1]; ++e) {
        const std::uint32_t other = graph_.neighbours[e];
        const State& state = states_[other];
        if (state.stage != State::kDone) continue;
        const double through = state.length + distance(centres_[other], centre);
        if (bend == cell || through < throughBend) {
            bend = other;
            throughBend = through;
        }
        if (state.turn == refused || state.turn == turn) continue;
        const double via = lengthVia(state.turn, cell);
        if ((turn == refused || via < length) && grid_.sees(turns_[state.turn].at, centre)) {
            turn = state.turn;
            length = via;
        }
    }
    const Turn last = turns_[states_[bend].turn];
    const Point3 at = tautTurn(last.at, centres_[bend], centre);
    const double soFar = last.length + distance(last.at, at);
    const double round = soFar + distance(at, centre);
    if (turn == refused || round < length) {
        turn = static_cast<std::uint32_t>(turns_.size());
        turns_.push_back({at, soFar});
        length = round;
    }
    put(cell, length, turn, true);
}

Point3 TautPaths::tautTurn(const Point3& last, const Point3& bend, const Point3& to) const {
    const Point3 straight = nearestOnLine(last, to, bend);
    // Cells that touch need not see each other's centres.
    if (!grid_.sees(bend, to)) return bend;
    double seen = 0.0;
    double hidden = 1.0;
    for (int i = 0; i < kHalvings; ++i) {
        const double middle = 0.5 * (seen + hidden);
        const Point3 at = bend + middle * (straight - bend);
        (grid_.sees(at, to) && grid_.sees(last, at) ? seen : hidden) = middle;
    }
    return bend + seen * (straight - bend);
}

}  // namespace shapedb
