// What searches read of up to a thousand shapes, in arrays: all that enters a score and nothing
// else, at most 512 bytes a shape.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/metadata.h"
#include "core/search/packed_statistics.h"
#include "core/signature/signature.h"

namespace shapedb {

struct IndexEntry {
    std::int64_t id = 0;  ///< > 0, unique in the set; breaks ties
    Metadata metadata;
    Signature signature;
};

/// Signatures by rising id. Immutable once shared: const members from any thread.
class SignatureBlock {
  public:
    /// Rows a block has room for: the ends of their parts are counted in 16 bits.
    static constexpr std::size_t kMostRows = 1024;
    static_assert(kMostRows * kMaxSignaturePoints <= 0xffff, "ends of parts would overflow");

    void reserve(std::size_t count);
    /// Ids must rise.
    void append(const IndexEntry& entry);
    /// Of another block.
    void append(const SignatureBlock& from, std::size_t row);
    /// Gives back what `reserve` took too much.
    void shrink();

    [[nodiscard]] std::size_t size() const { return ids_.size(); }
    [[nodiscard]] std::int64_t id(std::size_t row) const { return ids_[row]; }
    [[nodiscard]] const Metadata& metadata(std::size_t row) const { return metadata_[metadataOf_[row]]; }
    /// Rows with equal metadata mostly have the same number.
    [[nodiscard]] std::size_t metadataNumber(std::size_t row) const { return metadataOf_[row]; }
    [[nodiscard]] std::size_t metadataCount() const { return metadata_.size(); }

    [[nodiscard]] double scale(std::size_t row) const { return scales_[row]; }
    /// True: with ShapeAttributes; false: weighted points alone.
    [[nodiscard]] bool attributed(std::size_t row) const { return partsEnd_[row] > partsBegin(row); }
    [[nodiscard]] std::size_t attributedCount() const { return attributedCount_; }
    /// Of attributed rows.
    [[nodiscard]] std::uint8_t quality(std::size_t row) const { return qualities_[row]; }

    /// Statistics of all rows (zero where not attributed); null when no row is attributed.
    [[nodiscard]] const HalfRow* firstHalf() const { return first_.data(); }
    [[nodiscard]] const HalfRow* secondHalf() const { return second_.data(); }

    /// All that enters a score, with the bits of the signature that was appended. Of an attributed one
    /// the rest is left as it is: points, origin, volume, and the frame of the body. `signature` may
    /// hold anything; what it has allocated is used again.
    void scored(std::size_t row, Signature& signature) const;

    [[nodiscard]] std::size_t memoryBytes() const;

  private:
    // Of a signature without attributes.
    struct PackedPoint {
        std::array<float, 3> position{};
        float weight = 0.0f;
    };

    std::size_t partsBegin(std::size_t row) const { return row == 0 ? 0 : partsEnd_[row - 1]; }
    std::size_t pointsBegin(std::size_t row) const { return row == 0 ? 0 : pointsEnd_[row - 1]; }
    void appendMetadata(const Metadata& metadata);
    // Both halves of the row last begun.
    void appendStatistics(const HalfRow& first, const HalfRow& second);

    std::vector<std::int64_t> ids_;
    std::vector<double> scales_;
    std::vector<std::uint8_t> qualities_;
    std::vector<std::uint16_t> metadataOf_;
    std::vector<std::uint16_t> partsEnd_;   // of the row, in parts_
    std::vector<std::uint16_t> pointsEnd_;  // of the row, in points_
    std::vector<HalfRow> first_, second_;   // empty or one a row
    std::vector<PackedSegmentDescriptor> parts_;
    std::vector<PackedPoint> points_;
    std::vector<Metadata> metadata_;
    std::size_t attributedCount_ = 0;
};

}  // namespace shapedb
