// SPDX-License-Identifier: GPL-3.0-or-later
// What a search reads of up to a thousand shapes, in arrays: all that enters a score and nothing else, at
// most 512 bytes a shape, and 1,700 more for one with views.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/metadata.h"
#include "core/matching/shape_row.h"
#include "core/search/filter.h"
#include "core/signature/signature.h"
#include "core/views/view_distance.h"

namespace shapedb {

struct IndexEntry {
    std::int64_t id = 0;  ///< > 0, unique in the set; breaks ties
    Metadata metadata;
    Signature signature;
    std::shared_ptr<const ShapeViews> views{};  ///< null: none, a scan of one side is compared otherwise
    std::string key{};                          ///< for filters
};

/// Signatures in ascending order of id. Immutable once shared: const members from any thread.
class SignatureBlock {
  public:
    /// Rows a block has room for: the ends of their segments are counted in 16 bits.
    static constexpr std::size_t kMostRows = 1024;
    static_assert(kMostRows * kMaxSignaturePoints <= 0xffff, "ends of segments would overflow");

    void reserve(std::size_t count);
    /// Ids must rise.
    void append(const IndexEntry& entry);
    /// A row of another block.
    void append(const SignatureBlock& from, std::size_t row);
    /// Returns the memory that `reserve` took too much.
    void shrink();

    [[nodiscard]] std::size_t size() const { return ids_.size(); }
    [[nodiscard]] std::int64_t id(std::size_t row) const { return ids_[row]; }
    /// Valid while the block lives unchanged.
    [[nodiscard]] std::string_view key(std::size_t row) const {
        const std::size_t begin = row == 0 ? 0 : keysEnd_[row - 1];
        return std::string_view(keys_).substr(begin, keysEnd_[row] - begin);
    }
    [[nodiscard]] const Metadata& metadata(std::size_t row) const { return metadata_[metadataOf_[row]]; }
    /// Rows with equal metadata usually share a number.
    [[nodiscard]] std::size_t metadataNumber(std::size_t row) const { return metadataOf_[row]; }
    [[nodiscard]] std::size_t metadataCount() const { return metadata_.size(); }

    [[nodiscard]] double scale(std::size_t row) const { return scales_[row]; }
    /// True: with ShapeAttributes; false: weighted points alone.
    [[nodiscard]] bool attributed(std::size_t row) const { return segmentsEnd_[row] > segmentsBegin(row); }
    [[nodiscard]] std::size_t attributedCount() const { return attributedCount_; }
    /// The row must be attributed.
    [[nodiscard]] std::uint8_t quality(std::size_t row) const { return qualities_[row]; }

    /// Null for a row without views.
    [[nodiscard]] const ShapeViews* views(std::size_t row) const {
        return views_.empty() ? nullptr : views_[row].get();
    }

    /// What scorers read, bit for bit as in the signatures that were appended: segments, statistics and
    /// quality of attributed ones, the points of others. Valid while the block lives unchanged.
    [[nodiscard]] ShapeRows rows() const;

    [[nodiscard]] std::size_t memoryBytes() const;

  private:
    std::size_t segmentsBegin(std::size_t row) const { return row == 0 ? 0 : segmentsEnd_[row - 1]; }
    std::size_t pointsBegin(std::size_t row) const { return row == 0 ? 0 : pointsEnd_[row - 1]; }
    void appendKey(std::string_view key);
    void appendMetadata(const Metadata& metadata);
    // Those of the row that was begun last; null: none.
    void appendViews(const std::shared_ptr<const ShapeViews>& views);
    // Both halves of the row that was begun last.
    void appendStatistics(const HalfRow& first, const HalfRow& second);

    std::vector<std::int64_t> ids_;
    std::vector<double> scales_;
    std::vector<std::uint8_t> qualities_;
    std::vector<std::uint8_t> earlier_;   // 1: ShapeAttributes::earlier
    std::string keys_;                    // one after the other
    std::vector<std::uint32_t> keysEnd_;  // of each row, in keys_
    std::vector<std::uint16_t> metadataOf_;
    std::vector<std::uint16_t> segmentsEnd_;  // of each row, in segments_
    std::vector<std::uint16_t> pointsEnd_;    // of each row, in points_
    std::vector<HalfRow> first_, second_;     // empty or one a row
    std::vector<PackedSegmentDescriptor> segments_;
    std::vector<PackedPoint> points_;                       // of rows without attributes
    std::vector<std::shared_ptr<const ShapeViews>> views_;  // empty or one a row
    std::vector<Metadata> metadata_;
    std::size_t attributedCount_ = 0;
};

// Which rows of a block a search looks at. For the sources of this folder.

/// 1 for each row of a block, which must have one, that passes the filter and is not excluded, otherwise 0.
/// Empty: all do.
[[nodiscard]] std::vector<std::uint8_t> wantedRows(const SignatureBlock& block, const Filter& filter,
                                                   std::optional<std::int64_t> excludeId);

}  // namespace shapedb
