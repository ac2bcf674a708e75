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
    metadataOf_.reserve(count);
    partsEnd_.reserve(count);
    pointsEnd_.reserve(count);
    first_.reserve(count);
    second_.reserve(count);
}

void SignatureBlock::shrink() {
    parts_.shrink_to_fit();
    points_.shrink_to_fit();
    metadata_.shrink_to_fit();
    first_.shrink_to_fit();
    second_.shrink_to_fit();
}

void SignatureBlock::appendMetadata(const Metadata& metadata) {
    // Shapes that came together are often labelled alike: looks at the last few.
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
    first_.resize(ids_.size() - 1);
    second_.resize(ids_.size() - 1);
    first_.push_back(first);
    second_.push_back(second);
    ++attributedCount_;
}

void SignatureBlock::append(const IndexEntry& entry) {
    const Signature& signature = entry.signature;
    ids_.push_back(entry.id);
    scales_.push_back(signature.scale);
    qualities_.push_back(signature.attributes ? signature.attributes->quality : 0);
    appendMetadata(entry.metadata);
    if (signature.attributes) {
        HalfRow first, second;
        packStatistics(signature.attributes->statistics, first, second);
        appendStatistics(first, second);
        for (const SegmentDescriptor& part : signature.attributes->body.parts) parts_.push_back(packed(part));
    } else {
        for (const WeightedPoint& p : signature.points) points_.push_back({p.position, p.weight});
        if (!first_.empty()) first_.resize(ids_.size());
        if (!second_.empty()) second_.resize(ids_.size());
    }
    partsEnd_.push_back(static_cast<std::uint16_t>(parts_.size()));
    pointsEnd_.push_back(static_cast<std::uint16_t>(points_.size()));
}

void SignatureBlock::append(const SignatureBlock& from, std::size_t row) {
    ids_.push_back(from.ids_[row]);
    scales_.push_back(from.scales_[row]);
    qualities_.push_back(from.qualities_[row]);
    appendMetadata(from.metadata(row));
    if (from.attributed(row)) {
        appendStatistics(from.first_[row], from.second_[row]);
    } else {
        if (!first_.empty()) first_.resize(ids_.size());
        if (!second_.empty()) second_.resize(ids_.size());
    }
    for (std::size_t i = from.partsBegin(row); i < from.partsEnd_[row]; ++i) parts_.push_back(from.parts_[i]);
    for (std::size_t i = from.pointsBegin(row); i < from.pointsEnd_[row]; ++i)
        points_.push_back(from.points_[i]);
    partsEnd_.push_back(static_cast<std::uint16_t>(parts_.size()));
    pointsEnd_.push_back(static_cast<std::uint16_t>(points_.size()));
}

void SignatureBlock::scored(std::size_t row, Signature& signature) const {
    signature.scale = scales_[row];
    if (!attributed(row)) {
        signature.attributes.reset();
        signature.points.clear();
        for (std::size_t i = pointsBegin(row); i < pointsEnd_[row]; ++i) {
            WeightedPoint point;
            point.position = points_[i].position;
            point.weight = points_[i].weight;
            signature.points.push_back(point);
        }
        return;
    }
    if (!signature.attributes) signature.attributes.emplace();
    ShapeAttributes& attributes = *signature.attributes;
    attributes.quality = qualities_[row];
    unpackStatistics(first_[row], second_[row], attributes.statistics);
    attributes.body.parts.clear();
    for (std::size_t i = partsBegin(row); i < partsEnd_[row]; ++i) {
        attributes.body.parts.push_back(unpacked(parts_[i]));
    }
}

std::size_t SignatureBlock::memoryBytes() const {
    std::size_t bytes = sizeof *this + bytesOf(ids_) + bytesOf(scales_) + bytesOf(qualities_) +
                        bytesOf(metadataOf_) + bytesOf(partsEnd_) + bytesOf(pointsEnd_) + bytesOf(first_) +
                        bytesOf(second_) + bytesOf(parts_) + bytesOf(points_) + bytesOf(metadata_);
    for (const Metadata& metadata : metadata_) {
        // A node of the tree: two strings, three pointers, a colour.
        constexpr std::size_t kNode = 2 * sizeof(std::string) + 32;
        for (const auto& [key, value] : metadata) bytes += kNode + key.capacity() + value.capacity();
    }
    return bytes;
}

}  // namespace shapedb
