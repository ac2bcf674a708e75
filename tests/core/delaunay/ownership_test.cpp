// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/ownership.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "core/delaunay/start_cells.h"

namespace shapedb {
namespace {

constexpr std::uint8_t kWorkers = 3;

// Calls `visit(workerOf, corners)` for every way in which the vertices of a finite cell, and of a cell at
// infinity, can belong to workers.
template <typename Visit>
void forEveryCell(const Visit& visit) {
    for (unsigned code = 0; code < 81; ++code) {
        std::array<std::uint8_t, 4> workerOf{};
        unsigned rest = code;
        for (std::uint8_t& worker : workerOf) {
            worker = static_cast<std::uint8_t>(rest % kWorkers);
            rest /= kWorkers;
        }
        visit(workerOf.data(), std::array<std::uint32_t, 4>{0, 1, 2, 3});
        visit(workerOf.data(), std::array<std::uint32_t, 4>{0, kInfinite, 2, 3});
    }
}

int ownersOf(const std::uint8_t* workerOf, const std::array<std::uint32_t, 4>& corners) {
    int owners = 0;
    for (std::uint8_t k = 0; k < kWorkers; ++k) owners += Ownership{workerOf, k}.ownsCell(corners) ? 1 : 0;
    return owners;
}

TEST(Ownership, GivesACellToAtMostOneWorker) {
    forEveryCell([](const std::uint8_t* workerOf, const std::array<std::uint32_t, 4>& corners) {
        EXPECT_LE(ownersOf(workerOf, corners), 1);
    });
}

// Rule 2 lets at most one worker touch the neighbour entry behind a facet.
TEST(Ownership, OpensAFacetToAtMostOneWorker) {
    forEveryCell([](const std::uint8_t* workerOf, const std::array<std::uint32_t, 4>& v) {
        for (const auto& f : kFacet) {
            int open = 0;
            for (std::uint8_t k = 0; k < kWorkers; ++k) {
                open += Ownership{workerOf, k}.ownsTwoOf(v[f[0]], v[f[1]], v[f[2]]) ? 1 : 0;
            }
            EXPECT_LE(open, 1);
        }
    });
}

// So no cell of another worker lies next to an owned cell.
TEST(Ownership, OwnerOfACellMayCrossAllItsFacets) {
    forEveryCell([](const std::uint8_t* workerOf, const std::array<std::uint32_t, 4>& v) {
        for (std::uint8_t k = 0; k < kWorkers; ++k) {
            const Ownership ownership{workerOf, k};
            if (!ownership.ownsCell(v)) continue;
            for (const auto& f : kFacet) EXPECT_TRUE(ownership.ownsTwoOf(v[f[0]], v[f[1]], v[f[2]]));
        }
    });
}

TEST(Ownership, CellAtInfinityHasNoSoleOwner) {
    const std::array<std::uint8_t, 4> all{};
    EXPECT_TRUE((Ownership{all.data(), 0}.ownsAllOf({0, 1, 2, 3})));
    EXPECT_FALSE((Ownership{all.data(), 0}.ownsAllOf({0, 1, kInfinite, 3})));
    EXPECT_TRUE((Ownership{all.data(), 0}.ownsCell({0, 1, kInfinite, 3})));
}

TEST(StartCells, VisitsTheNearestSlotsFirstUntilOneServes) {
    constexpr std::uint32_t kSites = 10 * StartCells::kSlots;
    StartCells starts(kSites);
    for (const std::uint32_t slot : {97U, 99U, 100U, 102U, 104U}) starts.add(10 * slot, slot);
    std::vector<std::uint32_t> seen;
    starts.visitNear(1005, [&](std::uint32_t cell) {
        seen.push_back(cell);
        return false;
    });
    EXPECT_EQ(seen, (std::vector<std::uint32_t>{100, 99, 102, 97}));  // 104 is too far
    seen.clear();
    starts.visitNear(1005, [&](std::uint32_t cell) {
        seen.push_back(cell);
        return cell == 99;
    });
    EXPECT_EQ(seen, (std::vector<std::uint32_t>{100, 99}));
    // Slots beyond either end are not looked at.
    starts.visitNear(0, [](std::uint32_t) { return true; });
    starts.visitNear(kSites - 1, [](std::uint32_t) { return true; });
}

}  // namespace
}  // namespace shapedb
