// SPDX-License-Identifier: Apache-2.0
#include "client/backup/increment_file.h"

#include <limits>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::client {

Result<IncrementHead> readIncrementHead(const SourceFile& file) {
    const auto named = [&](const Error& error) {
        return fail(error.code, "'" + file.path() + "' " + error.message);
    };
    const auto prefix = file.beginning(kIncrementPrefixBytes);
    RETURN_IF_ERROR(prefix);
    const auto size = incrementHeadBytes(*prefix, file.bytes());
    if (!size) return named(size.error());
    const auto text = file.beginning(*size);
    RETURN_IF_ERROR(text);
    auto head = decodeIncrementHead(*text, file.bytes());
    if (!head) return named(head.error());
    return head;
}

IncrementBlocks::IncrementBlocks(SourceFile file, const IncrementHead& head)
    : file_(std::move(file)),
      resultBytes_(head.result.backup.bytes),
      blockBytes_(head.result.blockBytes),
      at_(file_.bytes() - changedBytes(head)) {
    blocks_.reserve(head.changed.size());
    for (const std::uint32_t block : head.changed) blocks_.push_back({block, head.result.blocks[block]});
}

std::uint64_t IncrementBlocks::begin() const {
    if (next_ == blocks_.size()) return std::numeric_limits<std::uint64_t>::max();
    return blocks_[next_].index * blockBytes_;
}

std::uint64_t IncrementBlocks::end() const {
    if (next_ == blocks_.size()) return std::numeric_limits<std::uint64_t>::max();
    return begin() + bytesOfBlock(resultBytes_, blockBytes_, blocks_[next_].index);
}

void IncrementBlocks::skipTo(std::uint64_t position) {
    while (next_ < blocks_.size() && end() <= position) {
        at_ += end() - begin();
        ++next_;
    }
}

Result<void> IncrementBlocks::read(char* to, std::size_t size) {
    RETURN_IF_ERROR(file_.read(at_ + read_, to, size));
    hash_.update(to, size);
    read_ += size;
    if (read_ < end() - begin()) return {};
    read_ = 0;
    if (hash_.finish() == blocks_[next_].hash) return {};
    return fail(ErrorCode::kMalformedFile, "'" + file_.path() + "' is damaged: block " +
                                               std::to_string(blocks_[next_].index) + " has the wrong hash");
}

}  // namespace shapedb::client
