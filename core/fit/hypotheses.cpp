// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/hypotheses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/base/math.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr double kRollDegrees = 15.0;
constexpr int kRolls = 6;  // to a quarter turn, after which the axes lie on each other again

// All poses are judged by a glance at a few points of the query, the best of them by more points.
constexpr std::size_t kGlances = 16;
constexpr std::size_t kKeptPerTurn = 2;
constexpr std::size_t kJudges = 128;

// Points that measure how far a turned shape reaches.
constexpr std::size_t kOutline = 64;

// One-sided: extent along the view over the smallest extent.
constexpr double kDeepest = 1.7;

// An outline narrower than this is none to divide by.
constexpr double kLeastAcross = 1e-6;

// A piece may be as large as the whole or smaller: diagonal of the whole over that of the piece.
constexpr std::array<double, 5> kPieceScales = {1.0, 1.12, 1.25, 1.4, 1.6};

using Extent = std::array<double, 3>;

struct Reach {
    Extent low{};
    Extent high{};
};

// The 24 rotations that lay axes on axes, each rolled about each axis in steps; those that a roll by a
// quarter turn would repeat are left out.
std::vector<Matrix3> makeRotations() {
    std::vector<Matrix3> rotations;
    std::array<std::size_t, 3> order = {0, 1, 2};
    std::vector<Matrix3> onAxes;
    do {
        for (unsigned signs = 0; signs < 8; ++signs) {
            Matrix3 m{};
            for (std::size_t i = 0; i < 3; ++i) m[i][order[i]] = (signs >> i) & 1u ? -1.0 : 1.0;
            if (determinant(m) > 0.0) onAxes.push_back(m);
        }
    } while (std::next_permutation(order.begin(), order.end()));
    for (const Matrix3& m : onAxes) rotations.push_back(m);
    for (const Matrix3& m : onAxes) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (int step = 1; step < kRolls; ++step) {
                rotations.push_back(multiply(rotationAboutAxis(axis, toRadians(kRollDegrees * step)), m));
            }
        }
    }
    return rotations;
}

const std::vector<Matrix3>& rotations() {
    static const std::vector<Matrix3> all = makeRotations();
    return all;
}

Reach reachOf(const SurfaceColumns& points, std::size_t count, const Matrix3& rotation, std::vector<float>& x,
              std::vector<float>& y, std::vector<float>& z) {
    Motion turn;
    turn.rotation = rotation;
    moveColumns(points, count, Affine(turn), x.data(), y.data(), z.data());
    Reach reach;
    std::size_t axis = 0;
    for (const auto* column : {&x, &y, &z}) {
        Float8 low = loadLanes(column->data());
        Float8 high = low;
        for (std::size_t i = kFloatLanes; i < count; i += kFloatLanes) {
            const Float8 v = loadLanes(column->data() + i);
            low = lesser(low, v);
            high = greater(high, v);
        }
        float lowest = low[0];
        float highest = high[0];
        for (std::size_t lane = 1; lane < kFloatLanes; ++lane) {
            lowest = std::min(lowest, low[lane]);
            highest = std::max(highest, high[lane]);
        }
        reach.low[axis] = static_cast<double>(lowest);
        reach.high[axis] = static_cast<double>(highest);
        ++axis;
    }
    return reach;
}

// One placement of a turned shape: how large, and where.
struct Placement {
    double scale = 1.0;
    Extent shift{};
    std::size_t axis = 2;  // of the view, and which end of it is in front
    float front = 1.0f;
};

// Better first; equal scores in the order in which poses are tried.
struct Tried {
    float score = 0.0f;
    std::uint32_t turn = 0;       // index into turns_
    std::uint32_t placement = 0;  // index into what place() gives for this turn

    friend bool operator<(const Tried& a, const Tried& b) {
        if (a.score != b.score) return a.score > b.score;
        return a.turn != b.turn ? a.turn < b.turn : a.placement < b.placement;
    }
};

void keepBest(std::vector<Tried>& tried, std::size_t most) {
    const auto end = tried.begin() + static_cast<std::ptrdiff_t>(std::min(most, tried.size()));
    std::nth_element(tried.begin(), end, tried.end());
    tried.erase(end, tried.end());
}

class Search {
  public:
    Search(const FitPoints& query, const FitPoints& other, FitKind kind, const FitOptions& options)
        : query_(query),
          other_(other),
          kind_(kind),
          options_(options),
          keptScale_(other.toScan.scale / query.toScan.scale) {
        const std::size_t most =
            std::max({query.prefix(kJudges), other.prefix(kJudges), other.prefix(kOutline)});
        for (auto* column : {&x_, &y_, &z_}) column->resize(most);
        half_ = {query.half.x, query.half.y, query.half.z};
        findTurns();
    }

    Result<std::vector<Hypothesis>> best(std::size_t count, const RunContext& context) {
        std::vector<Tried> tried;
        constexpr std::uint32_t kTurnsBetweenCheckpoints = 96;
        for (std::uint32_t turn = 0; turn < turns_.size(); ++turn) {
            if (turn % kTurnsBetweenCheckpoints == 0) RETURN_IF_ERROR(context.checkpoint());
            glance(turn, tried);
        }
        RETURN_IF_ERROR(context.checkpoint());
        for (Tried& t : tried) t.score = judged(t);
        keepBest(tried, count);
        std::sort(tried.begin(), tried.end());
        std::vector<Hypothesis> result;
        for (const Tried& t : tried) {
            place(turns_[t.turn].reach);
            const Placement& p = placements_[t.placement];
            result.push_back({poseOf(turns_[t.turn], p), {kind_, p.axis, p.front}});
        }
        return result;
    }

  private:
    struct Turn {
        Matrix3 rotation;
        bool reflected = false;
        Reach reach;
    };

    void findTurns() {
        const std::size_t outline = other_.prefix(kOutline);
        for (const bool reflected : {false, true}) {
            if (reflected && !options_.reflection) break;
            for (const Matrix3& rotation : rotations()) {
                Turn turn{rotation, reflected, {}};
                if (reflected) {
                    for (auto& row : turn.rotation) row[2] = -row[2];
                }
                turn.reach = reachOf(other_.columns, outline, turn.rotation, x_, y_, z_);
                turns_.push_back(turn);
            }
        }
    }

    static Motion poseOf(const Turn& turn, const Placement& p) {
        Motion pose;
        pose.rotation = turn.rotation;
        pose.reflected = turn.reflected;
        pose.scale = p.scale;
        pose.translation = {p.shift[0], p.shift[1], p.shift[2]};
        return pose;
    }

    // All placements of a turned shape by a few points of the query. These are turned and scaled once; each
    // placement only shifts them.
    void glance(std::uint32_t number, std::vector<Tried>& tried) {
        const Turn& turn = turns_[number];
        place(turn.reach);
        Motion back;
        back.rotation = transposed(turn.rotation);
        const std::size_t glances = query_.prefix(kGlances);
        double scale = 0.0;
        std::array<Tried, kKeptPerTurn> kept{};
        for (std::uint32_t i = 0; i < placements_.size(); ++i) {
            const Placement& p = placements_[i];
            if (p.scale != scale) {
                scale = p.scale;
                back.scale = static_cast<double>(other_.grid.scale()) / scale;
                moveColumns(query_.columns, glances, Affine(back), x_.data(), y_.data(), z_.data());
            }
            const Point3 shift = back.scale * rotate(back.rotation, {p.shift[0], p.shift[1], p.shift[2]});
            const auto& o = other_.grid.offset();
            const std::array<float, 3> offset = {o[0] - static_cast<float>(shift.x),
                                                 o[1] - static_cast<float>(shift.y),
                                                 o[2] - static_cast<float>(shift.z)};
            const auto sum = closenessSum(other_.grid, x_.data(), y_.data(), z_.data(), glances, offset);
            Tried now{static_cast<float>(sum), number, i};
            for (Tried& best : kept) {
                if (now.score > best.score) std::swap(now, best);
            }
        }
        for (const Tried& best : kept) {
            if (best.score > 0.0f) tried.push_back(best);
        }
    }

    // By more points; a whole query also by those of the other shape.
    float judged(const Tried& tried) {
        const Turn& turn = turns_[tried.turn];
        place(turn.reach);
        const Motion pose = poseOf(turn, placements_[tried.placement]);
        const auto score = static_cast<float>(closenessOf(query_, inverse(pose), other_.grid));
        if (kind_ != FitKind::kWhole) return score;
        return score * static_cast<float>(closenessOf(other_, pose, query_.grid));
    }

    std::uint32_t closenessOf(const FitPoints& points, Motion toGrid, const NearestGrid& grid) {
        const std::size_t judges = points.prefix(kJudges);
        const auto scale = static_cast<double>(grid.scale());
        toGrid.scale *= scale;
        toGrid.translation = scale * toGrid.translation;
        moveColumns(points.columns, judges, Affine(toGrid), x_.data(), y_.data(), z_.data());
        return closenessSum(grid, x_.data(), y_.data(), z_.data(), judges, grid.offset());
    }

    void place(const Reach& reach) {
        placements_.clear();
        switch (kind_) {
            case FitKind::kWhole: placeWhole(reach); break;
            case FitKind::kOneSided: placeFronts(reach); break;
            case FitKind::kPiece: placeCorners(reach); break;
        }
    }

    // Middles of the boxes on each other.
    void placeWhole(const Reach& reach) {
        Placement p;
        p.scale = options_.keepScale ? keptScale_ : 1.0;
        for (std::size_t k = 0; k < 3; ++k) p.shift[k] = -0.5 * p.scale * (reach.low[k] + reach.high[k]);
        placements_.push_back(p);
    }

    // Outlines across the view on each other, and either what is nearest to the one end of the view or what
    // is nearest to the other. A scan is seldom deeper than it is wide: the view is along the third axis, or
    // along another that is hardly longer.
    void placeFronts(const Reach& reach) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (half_[axis] > kDeepest * half_[2]) continue;
            const std::size_t j = (axis + 1) % 3;
            const std::size_t k = (axis + 2) % 3;
            const double across = reach.high[j] - reach.low[j] + reach.high[k] - reach.low[k];
            Placement p;
            p.axis = axis;
            p.scale = options_.keepScale ? keptScale_
                                         : 2.0 * (half_[j] + half_[k]) / std::max(across, kLeastAcross);
            p.shift[j] = -0.5 * p.scale * (reach.low[j] + reach.high[j]);
            p.shift[k] = -0.5 * p.scale * (reach.low[k] + reach.high[k]);
            p.shift[axis] = half_[axis] - p.scale * reach.high[axis];
            p.front = 1.0f;
            placements_.push_back(p);
            p.shift[axis] = -half_[axis] - p.scale * reach.low[axis];
            p.front = -1.0f;
            placements_.push_back(p);
        }
    }

    // Each corner of the query's box on the same corner of the other's.
    void placeCorners(const Reach& reach) {
        const std::size_t scales = options_.keepScale ? 1 : kPieceScales.size();
        for (std::size_t i = 0; i < scales; ++i) {
            Placement p;
            p.scale = options_.keepScale ? keptScale_ : kPieceScales[i];
            for (unsigned corner = 0; corner < 8; ++corner) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const bool high = ((corner >> k) & 1u) != 0;
                    p.shift[k] =
                        high ? half_[k] - p.scale * reach.high[k] : -half_[k] - p.scale * reach.low[k];
                }
                placements_.push_back(p);
            }
        }
    }

    const FitPoints& query_;
    const FitPoints& other_;
    const FitKind kind_;
    const FitOptions& options_;
    const double keptScale_;  // from the other's frame to the query's
    Extent half_{};
    std::vector<float> x_, y_, z_;
    std::vector<Turn> turns_;
    std::vector<Placement> placements_;
};

}  // namespace

Result<std::vector<Hypothesis>> promisingPoses(const FitPoints& query, const FitPoints& other, FitKind kind,
                                               const FitOptions& options, std::size_t count,
                                               const RunContext& context) {
    return Search(query, other, kind, options).best(count, context);
}

}  // namespace shapedb
