// SPDX-License-Identifier: GPL-3.0-or-later
// A script recorded step by step, so that each step can be repeated from the files before it, with something
// failing inside.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/reliability/support/disk.h"
#include "tests/reliability/support/script.h"

namespace shapedb::reliability {

/// One step, and what is stored before and after it.
struct Moment {
    Step step;
    std::int64_t clock = 0;
    Memory memory;
    bool isOpen = false;  ///< whether the store is open before the step
    Image files;          ///< as a process that is killed before the step leaves them
    std::string before;   ///< dumps
    std::string after;
};

/// Runs the steps one after another on the files given; the store is closed at first.
[[nodiscard]] std::vector<Moment> record(const std::vector<Step>& steps, const Image& files);
/// The files of a store that has run the steps and was closed.
[[nodiscard]] Image filesAfter(const std::vector<Step>& steps);

/// The script of all calls, from no file at all; ends with the store closed and opened again.
[[nodiscard]] std::vector<Moment> recordWholeScript();

/// Opening the databases that older versions of ShapeDB wrote (tests/golden/).
[[nodiscard]] std::vector<Moment> recordMigrations();

/// Something that can fail once, at any of many places.
struct Trouble {
    std::string name;
    std::function<void(std::uint64_t at)> arm;  ///< from 1
    std::function<void()> disarm;
    std::function<bool()> fired;            ///< since it was armed
    std::function<std::uint64_t()> places;  ///< passed since it was armed
    std::function<bool(ErrorCode)> fits;    ///< whether this error says what went wrong
    bool losesSyncs = false;                ///< power is lost at the end, too
};

struct Tally {
    std::uint64_t tried = 0;      ///< places
    std::uint64_t errors = 0;     ///< calls that failed
    std::uint64_t unnoticed = 0;  ///< calls that succeeded nevertheless
};

/// Where trouble is tried.
struct Places {
    std::uint64_t all = 0;                          ///< there are
    std::vector<std::vector<std::uint64_t>> tried;  ///< of these, for each moment, from 1
};

/// Every `every`-th place in the moments, all of them counted through.
[[nodiscard]] Places everyPlace(std::uint64_t every, const std::vector<Moment>& moments,
                                const Trouble& trouble);

/// The same of the places that `choose` returns after each moment has passed without trouble; `begin` is
/// called before it.
[[nodiscard]] Places chosenPlaces(std::uint64_t every, const std::vector<Moment>& moments,
                                  const Trouble& trouble, const std::function<void()>& begin,
                                  const std::function<std::vector<std::uint64_t>()>& choose);

/// Repeats each moment with trouble at each of the places. The call fails with a fitting error and changes
/// nothing, or succeeds; with the trouble gone, the same store does it, is sound, holds no lock and no
/// memory, and starts again with what was acknowledged. Adds test failures otherwise.
void tryTrouble(const std::vector<Moment>& moments, const Places& places, const Trouble& trouble,
                Tally& tally);

}  // namespace shapedb::reliability
