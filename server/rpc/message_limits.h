// Limits of the gRPC transport; server/catalog/limits.h has those of the API.
#pragma once

#include <chrono>
#include <cstddef>

namespace shapedb::rpc {

constexpr int kMaxReceiveBytes = 4 << 20;
constexpr int kMaxCallThreads = 256;                  ///< calls at a time, streams included
constexpr std::size_t kLabelledChunkPoints = 32'768;  ///< in one LabelledChunk
/// Of an error message: it travels in a header, and headers are small.
constexpr std::size_t kMaxErrorMessageBytes = 2'048;

constexpr std::chrono::milliseconds kKeepaliveTime{60'000};
constexpr std::chrono::milliseconds kKeepaliveTimeout{20'000};
constexpr std::chrono::milliseconds kShortestClientPing{10'000};

}  // namespace shapedb::rpc
