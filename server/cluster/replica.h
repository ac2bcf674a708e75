// SPDX-License-Identifier: GPL-3.0-or-later
// A copy of some shards of one collection in memory, which follows the changes in the database.
//
// Each write takes the next number of its collection in its own transaction, so that numbers are in the order
// of commits and without gaps. A replica reads which shapes changed since the number that it knows, and what
// these are now. What they are now may be newer than the number: such a shape is read once more when its
// number comes. A rebuild's switch of generations shows in every read: then everything is read again, while
// the old generation serves on.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "server/cluster/shard.h"
#include "server/store/store.h"

namespace shapedb::cluster {

/// Of a collection, as one transaction saw it.
struct Position {
    std::int64_t number = 0;      ///< of its last change
    std::int64_t generation = 0;  ///< of the signatures that serve
};

/// The next changes, and what became of their shapes.
struct Changes {
    Position at;                        ///< of the transaction
    std::int64_t upTo = 0;              ///< the last change included; `at.number` if all are
    bool forgotten = false;             ///< some are not kept any more: nothing but `at` is set
    std::vector<std::int64_t> changed;  ///< ids of shapes, without repetition
    std::vector<store::IndexRow> rows;  ///< of those that have a signature that serves, now
};

struct Rows {
    Position at;
    std::vector<store::IndexRow> rows;  ///< in ascending order of id
    std::int64_t upTo = 0;              ///< those with ids up to this one are among them, or have been
    bool last = false;                  ///< there are no more
};

/// The database. Each call is one short transaction that sees one moment. Errors: those of store.h; kNotFound
/// (the collection is gone).
class ReplicaSource {
  public:
    virtual ~ReplicaSource() = default;
    /// At most `limit` changes after number `after`, of shapes in `shards`; those of others count, and are
    /// left out of `changed`.
    [[nodiscard]] virtual Result<Changes> changes(std::int64_t collectionId, std::int64_t after,
                                                  const ShardSet& shards, std::size_t limit) = 0;
    /// Some of the rows with id > afterId, at most `limit`: the next page.
    [[nodiscard]] virtual Result<Rows> rows(std::int64_t collectionId, const ShardSet& shards,
                                            std::int64_t afterId, std::size_t limit) = 0;
};

/// Where the rows go. Called by one thread; searches read what was shown last.
class ReplicaContent {
  public:
    virtual ~ReplicaContent() = default;
    /// Begins a content of this generation without any rows. What serves goes on serving.
    virtual void begin(std::int64_t generation) = 0;
    /// Rows of the content that was begun last, added or in place of those with the same id. They may be
    /// taken in later, but before what is called next takes effect; an error is that of the rows before,
    /// then, and the content is to be begun again.
    [[nodiscard]] virtual Result<void> put(std::vector<store::IndexRow> rows) = 0;
    /// Removes these shapes, if they are there.
    virtual void remove(const std::vector<std::int64_t>& shapeIds) = 0;
    /// Removes all shapes of these shards.
    virtual void drop(const ShardSet& shards) = 0;
    /// From now on searches see the content that was begun last, as it is. It is complete in these shards,
    /// and knows all changes up to this one.
    /// Errors: as `put`.
    [[nodiscard]] virtual Result<void> show(const ShardSet& complete, std::int64_t number) = 0;
};

/// Drives one content. Shards are loaded some at a time, and shown as they are there. Not thread-safe.
class Replica {
  public:
    /// Neither is owned.
    Replica(ReplicaSource& source, ReplicaContent& content, std::int64_t collectionId, std::size_t pageRows)
        : source_(source), content_(content), collectionId_(collectionId), pageRows_(pageRows) {}

    /// The shards to hold from now on; others are dropped.
    void setWanted(const ShardSet& wanted);
    /// Reads one page and applies it: the next changes, or rows of shards that are not there yet. True if
    /// there is more to do now, false if it knows all there was. Errors: those of the source and of the
    /// content; the step is done again by the next call.
    [[nodiscard]] Result<bool> step();

    /// Searches may be answered of these shards.
    [[nodiscard]] ShardSet complete() const { return shown_; }
    /// The last change that is known of all of them.
    [[nodiscard]] std::int64_t number() const { return number_; }

  private:
    Result<bool> begin();
    Result<bool> load();
    Result<bool> follow();
    [[nodiscard]] ShardSet toLoad() const;
    void startLoading(const ShardSet& shards);
    Result<void> put(std::vector<store::IndexRow> rows);
    Result<void> show();

    ReplicaSource& source_;
    ReplicaContent& content_;
    std::int64_t collectionId_;
    std::size_t pageRows_;
    ShardSet wanted_;
    ShardSet complete_;  ///< of the content that was begun last
    ShardSet loading_;   ///< being read, from `loadAfter_` on
    ShardSet shown_;     ///< what searches see
    std::int64_t loadAfter_ = 0;
    std::int64_t generation_ = 0;  ///< of the content that was begun last; 0: none was
    std::int64_t known_ = 0;       ///< the last change that the content begun last knows
    std::int64_t number_ = 0;      ///< the same of what is shown
    bool replacing_ = false;       ///< an older generation is shown
    bool followNext_ = false;      ///< while loading, pages and changes take turns
};

}  // namespace shapedb::cluster
