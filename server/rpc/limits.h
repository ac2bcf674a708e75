// Every limit of the API that is not configurable, in one place. The configurable ones are
// config::ServerConfig::limits.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace shapedb::rpc {

// What a name may be (proto comments repeat these).
constexpr std::size_t kMaxCollectionNameBytes = 128;
constexpr std::size_t kMaxDescriptionBytes = 1'024;
constexpr std::size_t kMaxKeyBytes = 512;
constexpr std::size_t kMaxMetadataEntries = 64;
constexpr std::size_t kMaxMetadataKeyBytes = 128;
constexpr std::size_t kMaxMetadataValueBytes = 1'024;
constexpr std::size_t kMaxFilterBytes = 16'384;

// Scans.
constexpr std::size_t kPointBytes = 12;  ///< float32 x y z
constexpr std::uint64_t kMinPoints = 4;
constexpr std::size_t kMaxChunkBytes = std::size_t{1} << 20;
constexpr std::size_t kLabelledChunkPoints = 32'768;  ///< of one LabelledChunk sent

// Listings and answers.
constexpr std::uint32_t kDefaultPageSize = 100;
constexpr std::uint32_t kMaxPageSize = 1'000;
/// A page of a listing ends early rather than pass this: gRPC clients accept 4 MiB by default.
constexpr std::size_t kMaxPageBytes = std::size_t{3} << 20;
/// An answer to a search is refused past this.
constexpr std::size_t kMaxAnswerBytes = std::size_t{64} << 20;
/// Of the message of an error: it travels in a header, and those are small.
constexpr std::size_t kMaxErrorMessageBytes = 2'048;

// Transport.
constexpr int kMaxReceiveBytes = 4 << 20;
constexpr int kMaxCallThreads = 256;  ///< calls at one moment, streams included
/// Calls that only wait for a shape or a rebuild: the other threads stay free for work.
constexpr int kMaxFollowers = 192;
constexpr std::chrono::milliseconds kKeepaliveTime{60'000};
constexpr std::chrono::milliseconds kKeepaliveTimeout{20'000};
constexpr std::chrono::milliseconds kShortestClientPing{10'000};

// Waiting inside calls.
constexpr std::chrono::milliseconds kLookForCancellation{20};
constexpr std::chrono::milliseconds kProgressInterval{100};  ///< between two messages of a check
/// Who waits for a shape reads its row again this often though nobody reported a change: it
/// may have gone with its collection.
constexpr std::chrono::milliseconds kReadStateAgain{1'000};
/// When a caller refused for lack of upload memory or of places to wait should try again.
constexpr std::chrono::milliseconds kBudgetRetry{500};

}  // namespace shapedb::rpc
