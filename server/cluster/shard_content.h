// SPDX-License-Identifier: GPL-3.0-or-later
// The signatures of some shards of one collection, as searches of this server read them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/search/signature_set.h"
#include "server/cluster/holder.h"
#include "server/cluster/replica.h"
#include "server/telemetry/logger.h"

namespace shapedb::cluster {

/// What a search reads. Immutable.
struct ShownContent {
    Content content;
    std::array<SignatureSet, kShards> shards;  ///< empty where they are not in `content.complete`
};
using ShownPtr = std::shared_ptr<const ShownContent>;

/// One thread changes it, through the functions of ReplicaContent; `shown` may be called by any.
class ShardContent final : public ReplicaContent {
  public:
    /// `onChanged` is told which shapes change, before searches see it: what else is kept of them is old.
    ShardContent(std::function<void(const std::vector<std::int64_t>&)> onChanged, telemetry::LoggerPtr log)
        : onChanged_(std::move(onChanged)), log_(std::move(log)) {}

    void begin(std::int64_t generation) override;
    [[nodiscard]] Result<void> put(std::vector<store::IndexRow> rows) override;
    void remove(const std::vector<std::int64_t>& shapeIds) override;
    void drop(const ShardSet& shards) override;
    [[nodiscard]] Result<void> show(const ShardSet& complete, std::int64_t number) override;

    /// Null until something was shown.
    [[nodiscard]] ShownPtr shown() const;

  private:
    const std::function<void(const std::vector<std::int64_t>&)> onChanged_;
    const telemetry::LoggerPtr log_;
    /// Entries are kept until there are enough to be worth a block.
    struct Shard {
        SignatureSet set;
        std::vector<IndexEntry> waiting;  ///< ids rise, above those of the set
        [[nodiscard]] std::int64_t lastId() const;
        void settle();
    };

    using Decoded = Result<std::vector<IndexEntry>>;
    [[nodiscard]] Decoded decode(std::vector<store::IndexRow> rows) const;
    /// Takes in what was put last.
    void takeIn();
    void append(std::vector<IndexEntry> entries);

    std::int64_t generation_ = 0;
    /// Of what was put last: decoded while the next rows are read.
    std::future<Decoded> decoding_;
    std::optional<Error> failure_;  ///< since the content was begun
    std::array<Shard, kShards> building_;
    mutable std::mutex mutex_;
    ShownPtr shown_;
};

}  // namespace shapedb::cluster
