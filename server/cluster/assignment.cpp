// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/assignment.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace shapedb::cluster {

namespace {

/// FNV-1a of the name, then mixed with the shard: the same on every machine.
std::uint64_t weight(const std::string& server, int shard) {
    std::uint64_t bits = 0xcbf29ce484222325u;
    for (const char c : server) bits = (bits ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    bits += static_cast<std::uint64_t>(shard) * 0x9e3779b97f4a7c15u;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
    return bits ^ (bits >> 31);
}

/// Indices of the servers, the one with the greatest weight first.
std::vector<int> preference(const std::vector<std::string>& servers, int shard) {
    std::vector<std::uint64_t> weights;
    weights.reserve(servers.size());
    for (const std::string& server : servers) weights.push_back(weight(server, shard));
    std::vector<int> order(servers.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
        return weights[static_cast<std::size_t>(a)] > weights[static_cast<std::size_t>(b)];
    });
    return order;
}

}  // namespace

std::vector<std::vector<int>> assignShards(const std::vector<std::string>& servers, int replicas) {
    std::vector<std::vector<int>> assignment(kShards);
    const std::size_t slots = std::min(static_cast<std::size_t>(replicas), servers.size());
    if (slots == 0) return assignment;
    const std::size_t most = (kShards * slots + servers.size() - 1) / servers.size();
    std::vector<std::size_t> load(servers.size(), 0);
    for (int shard = 0; shard < kShards; ++shard) {
        std::vector<int>& holders = assignment[static_cast<std::size_t>(shard)];
        const std::vector<int> order = preference(servers, shard);
        // First those with room, then any: the last shards may find room only on servers they have already.
        for (const bool bounded : {true, false}) {
            for (const int server : order) {
                if (holders.size() == slots) break;
                std::size_t& has = load[static_cast<std::size_t>(server)];
                if (bounded && has >= most) continue;
                if (std::find(holders.begin(), holders.end(), server) != holders.end()) continue;
                holders.push_back(server);
                ++has;
            }
        }
    }
    return assignment;
}

}  // namespace shapedb::cluster
