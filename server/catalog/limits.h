// SPDX-License-Identifier: GPL-3.0-or-later
// The limits of the API that are not configurable, whatever the transport. The configurable ones
// are config::ServerConfig::limits.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "common/protocol.h"
#include "server/store/key_rules.h"

namespace shapedb::catalog {

// Names and text (repeated in the comments of proto/).
using store::kMaxCollectionNameBytes;
using store::kMaxDescriptionBytes;
using store::kMaxKeyBytes;
using store::kMaxMetadataEntries;
using store::kMaxMetadataKeyBytes;
using store::kMaxMetadataValueBytes;
constexpr std::size_t kMaxFilterBytes = 16'384;

/// Metadata keys that begin so describe the points (earlier client libraries kept an offset under one):
/// whoever replaces all metadata without sending points does not mean them.
constexpr char kMetadataOfPoints[] = "shapedb.";

// Scans.
using shapedb::kPointBytes;
constexpr std::uint64_t kMinPoints = 4;
using shapedb::kMaxChunkBytes;

// Shapes that one call names, and changes of many.
constexpr std::size_t kMaxKeys = 1'000;
/// Changed in one transaction, so that no other write waits for long; of points at most so many bytes are
/// deleted at a time, or those of one shape.
constexpr std::size_t kShapesPerChange = 128;
constexpr std::uint64_t kPointBytesPerChange = std::uint64_t{16} << 20;

// Counts by value.
constexpr std::uint32_t kDefaultValues = 100;
constexpr std::uint32_t kMaxValues = 1'000;
/// A count keeps all values in memory until it knows the most frequent ones.
constexpr std::size_t kMaxDifferentValues = 100'000;

/// Hits of one group. With all groups of a search no more than its largest k.
constexpr std::uint32_t kMaxPerGroup = 100;

// Listings and answers.
constexpr std::uint32_t kDefaultPageSize = 100;
constexpr std::uint32_t kMaxPageSize = 1'000;
/// A page ends early rather than exceed this: gRPC clients accept 4 MiB by default.
constexpr std::size_t kMaxPageBytes = std::size_t{3} << 20;
/// Candidates that one search may verify.
constexpr std::uint32_t kMostVerified = 10'000;
/// A larger answer to a search is refused.
constexpr std::size_t kMaxAnswerBytes = std::size_t{64} << 20;
/// The answers being made of all calls together; more are refused. In memory they take about four times as
/// much.
constexpr std::size_t kMaxAnswersBytes = std::size_t{192} << 20;
/// Memory that the large messages of all calls may take once decoded.
constexpr std::uint64_t kMaxRequestsBytes = std::uint64_t{512} << 20;

// Calls at a time. A transport needs a thread for each, and some to refuse the rest.
constexpr int kMaxOrdinaryCalls = 208;
constexpr int kMaxAdminCalls = 16;
/// How many of them may be long ones: rebuilds, checks and copies. The others always find a place, so that a
/// key can be revoked and a rebuild cancelled.
constexpr int kMaxLongAdminCalls = 12;
/// Calls that only wait for a shape or a rebuild. With all uploads (limits.max_uploads) they leave places for
/// searches.
constexpr int kMaxFollowers = 96;
/// Backups and restores: each holds a copy of the database on the disk for as long as its client takes.
constexpr int kMaxCopies = 1;

// Waiting inside calls.
constexpr std::chrono::milliseconds kLookForCancellation{20};
constexpr std::chrono::milliseconds kProgressInterval{100};  ///< between two progress messages
/// A caller that waits for a shape reads its row again this often even if no change was reported: it
/// may have been deleted with its collection.
constexpr std::chrono::milliseconds kReadStateAgain{1'000};
/// Retry hint when upload memory or places to wait are used up.
constexpr std::chrono::milliseconds kBudgetRetry{500};
/// Retry hint while the database is being replaced, and for calls that it cut short.
constexpr std::chrono::milliseconds kRestoreRetry{1'000};

}  // namespace shapedb::catalog
