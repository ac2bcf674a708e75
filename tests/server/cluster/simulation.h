// SPDX-License-Identifier: GPL-3.0-or-later
// A cluster in one thread and in simulated time: servers with the keeper, the replica and the gather of
// server/cluster/, a database, and a network between them that delays, loses and reorders. One seed, one
// history, always the same.
//
// What an answer says is compared with what was committed when. The first difference ends the history.
#pragma once

#include <cstdint>
#include <string>

namespace shapedb::cluster::sim {

/// Milliseconds of simulated time.
using Time = std::int64_t;

struct Options {
    std::uint64_t seed = 1;
    int servers = 3;
    int replicas = 1;
    Time length = 20'000;
    Time term = 2'000;
    bool faults = true;  ///< kills, pauses, cut links, outages of the database, lost messages
};

struct Outcome {
    std::string difference;         ///< empty: none
    std::uint64_t answers = 0;      ///< complete ones, compared
    std::uint64_t unavailable = 0;  ///< searches that gave up
    std::uint64_t changes = 0;
    std::uint64_t switches = 0;  ///< of generations
    std::uint64_t faults = 0;
    Time longestOutage = 0;  ///< between the end of a search that gave up and the next answer
};

Outcome simulate(const Options& options);

}  // namespace shapedb::cluster::sim
