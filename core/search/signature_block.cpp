// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/signature_block.h"

namespace shapedb {

namespace {

template <typename T>
std::size_t bytesOf(const std::vector<T>& v) {
    return v.capacity() * sizeof(T);
}

}  // namespace

void SignatureBlock::reserve(std::size_t count) {
    ids_.reserve(count);
    scales_.reserve(count);
    qualities_.reserve(count);
    earlier_.reserve(count);
    keysEnd_.reserve(count);
    metadataOf_.reserve(count);
    segmentsEnd_.reserve(count);
    pointsEnd_.reserve(count);
    first_.reserve(count);
    second_.reserve(count);
}

void SignatureBlock::shrink() {
    keys_.shrink_to_fit();
    segments_.shrink_to_fit();
    points_.shrink_to_fit();
    metadata_.shrink_to_fit();
    first_.shrink_to_fit();
    second_.shrink_to_fit();
    views_.shrink_to_fit();
}

void SignatureBlock::appendKey(std::string_view key) {
    keys_ += key;
    keysEnd_.push_back(static_cast<std::uint32_t>(keys_.size()));
}

void SignatureBlock::appendMetadata(const Metadata& metadata) {
    // Shapes that were added together often have the same labels: the last few are looked at.
    constexpr std::size_t kLookBack = 16;
    for (std::size_t back = 1; back <= kLookBack && back <= metadata_.size(); ++back) {
        if (metadata_[metadata_.size() - back] != metadata) continue;
        metadataOf_.push_back(static_cast<std::uint16_t>(metadata_.size() - back));
        return;
    }
    metadataOf_.push_back(static_cast<std::uint16_t>(metadata_.size()));
    metadata_.push_back(metadata);
}

void SignatureBlock::appendStatistics(const HalfRow& first, const HalfRow& second) {
    // Rows without attributes that came before have zeros. Until the first one with attributes, there are no
    // statistics at all.
    first_.resize(ids_.size() - 1);
    second_.resize(ids_.size() - 1);
    first_.push_back(first);
    second_.push_back(second);
    ++attributedCount_;
}

void SignatureBlock::appendViews(const std::shared_ptr<const ShapeViews>& views) {
    if (!views && views_.empty()) return;
    views_.resize(ids_.size() - 1);
    views_.push_back(views);
}

void SignatureBlock::append(const IndexEntry& entry) {
    const Signature& signature = entry.signature;
    ids_.push_back(entry.id);
    scales_.push_back(signature.scale);
    qualities_.push_back(signature.attributes ? signature.attributes->quality : 0);
    earlier_.push_back(signature.attributes && signature.attributes->earlier ? 1 : 0);
    appendKey(entry.key);
    appendMetadata(entry.metadata);
    appendViews(entry.views);
    if (signature.attributes) {
        HalfRow first, second;
        packStatistics(signature.attributes->statistics, first, second);
        appendStatistics(first, second);
        for (const SegmentDescriptor& segment : signature.attributes->body.segments) {
            segments_.push_back(packed(segment));
        }
    } else {
        for (const WeightedPoint& p : signature.points) points_.push_back({p.position, p.weight});
        if (!first_.empty()) first_.resize(ids_.size());
        if (!second_.empty()) second_.resize(ids_.size());
    }
    segmentsEnd_.push_back(static_cast<std::uint16_t>(segments_.size()));
    pointsEnd_.push_back(static_cast<std::uint16_t>(points_.size()));
}

void SignatureBlock::append(const SignatureBlock& from, std::size_t row) {
    ids_.push_back(from.ids_[row]);
    scales_.push_back(from.scales_[row]);
    qualities_.push_back(from.qualities_[row]);
    earlier_.push_back(from.earlier_[row]);
    appendKey(from.key(row));
    appendMetadata(from.metadata(row));
    appendViews(from.views_.empty() ? nullptr : from.views_[row]);
    if (from.attributed(row)) {
        appendStatistics(from.first_[row], from.second_[row]);
    } else {
        if (!first_.empty()) first_.resize(ids_.size());
        if (!second_.empty()) second_.resize(ids_.size());
    }
    for (std::size_t i = from.segmentsBegin(row); i < from.segmentsEnd_[row]; ++i)
        segments_.push_back(from.segments_[i]);
    for (std::size_t i = from.pointsBegin(row); i < from.pointsEnd_[row]; ++i)
        points_.push_back(from.points_[i]);
    segmentsEnd_.push_back(static_cast<std::uint16_t>(segments_.size()));
    pointsEnd_.push_back(static_cast<std::uint16_t>(points_.size()));
}

ShapeRows SignatureBlock::rows() const {
    ShapeRows rows;
    rows.count = ids_.size();
    rows.attributedCount = attributedCount_;
    rows.scales = scales_.data();
    rows.qualities = qualities_.data();
    rows.earlier = earlier_.data();
    rows.firstHalves = first_.data();
    rows.secondHalves = second_.data();
    rows.segments = segments_.data();
    rows.segmentsEnd = segmentsEnd_.data();
    rows.points = points_.data();
    rows.pointsEnd = pointsEnd_.data();
    return rows;
}

std::size_t SignatureBlock::memoryBytes() const {
    std::size_t bytes = sizeof *this + bytesOf(ids_) + bytesOf(scales_) + bytesOf(qualities_) +
                        bytesOf(earlier_) + keys_.capacity() + bytesOf(keysEnd_) + bytesOf(metadataOf_) +
                        bytesOf(segmentsEnd_) + bytesOf(pointsEnd_) + bytesOf(first_) + bytesOf(second_) +
                        bytesOf(segments_) + bytesOf(points_) + bytesOf(metadata_) + bytesOf(views_);
    for (const auto& views : views_) bytes += views ? sizeof *views : 0;
    for (const Metadata& metadata : metadata_) {
        // A node of the tree: two strings, three pointers, a colour.
        constexpr std::size_t kNode = 2 * sizeof(std::string) + 32;
        for (const auto& [key, value] : metadata) bytes += kNode + key.capacity() + value.capacity();
    }
    return bytes;
}

std::vector<std::uint8_t> wantedRows(const SignatureBlock& block, const Filter& filter,
                                     std::optional<std::int64_t> excludeId) {
    const bool excludes = excludeId && block.id(0) <= *excludeId && *excludeId <= block.id(block.size() - 1);
    if (filter.acceptsAll() && !excludes) return {};
    std::vector<std::uint8_t> wanted(block.size());
    if (filter.asksForKeys()) {
        for (std::size_t row = 0; row < block.size(); ++row) {
            const bool passes = filter.matches(block.metadata(row), block.key(row));
            wanted[row] = passes && !(excludes && block.id(row) == *excludeId) ? 1 : 0;
        }
        return wanted;
    }
    // Rows share metadata, so the filter is asked once for each that occurs.
    constexpr std::uint8_t kUnknown = 2;
    std::vector<std::uint8_t> passes(block.metadataCount(), kUnknown);
    for (std::size_t row = 0; row < block.size(); ++row) {
        std::uint8_t& pass = passes[block.metadataNumber(row)];
        if (pass == kUnknown) pass = filter.matches(block.metadata(row)) ? 1 : 0;
        wanted[row] = excludes && block.id(row) == *excludeId ? 0 : pass;
    }
    return wanted;
}

}  // namespace shapedb
