// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/envelope.h"

#include <algorithm>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::http {
namespace {

constexpr std::size_t kHeadBytes = 5;

}  // namespace

std::string inEnvelope(std::uint8_t flags, std::string_view message) {
    std::string bytes;
    bytes.reserve(kHeadBytes + message.size());
    bytes += static_cast<char>(flags);
    for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(message.size() >> shift & 0xff);
    return bytes.append(message);
}

OrFailure<void> EnvelopeReader::add(std::string_view bytes, std::vector<std::string>& complete) {
    while (!bytes.empty()) {
        if (head_.size() < kHeadBytes) {
            const std::size_t taken = std::min(kHeadBytes - head_.size(), bytes.size());
            head_.append(bytes.substr(0, taken));
            bytes.remove_prefix(taken);
            if (head_.size() < kHeadBytes) return {};
            RETURN_IF_ERROR(readHead());
        }
        const std::size_t taken = std::min(missing_, bytes.size());
        message_.append(bytes.substr(0, taken));
        bytes.remove_prefix(taken);
        missing_ -= taken;
        if (missing_ > 0) return {};
        complete.push_back(std::exchange(message_, {}));
        head_.clear();
    }
    return {};
}

OrFailure<void> EnvelopeReader::readHead() {
    const auto flags = static_cast<std::uint8_t>(head_[0]);
    if (flags == 1) {
        return refuseWith(
            0, Code::kUnimplemented,
            "a message is marked as compressed: only uncompressed bodies (identity) are supported");
    }
    if (flags != kPlainMessage) {
        return refuse(ErrorCode::kMalformedStream, "a message of the request has the flags " +
                                                       std::to_string(flags) +
                                                       " in its envelope, where only 0 is allowed");
    }
    missing_ = 0;
    for (std::size_t i = 1; i < kHeadBytes; ++i)
        missing_ = missing_ << 8 | static_cast<unsigned char>(head_[i]);
    if (missing_ <= mostBytes_) return {};
    return refuseWith(0, Code::kResourceExhausted,
                      "a message of " + std::to_string(missing_) + " bytes is announced, and at most " +
                          std::to_string(mostBytes_) + " are taken");
}

}  // namespace shapedb::http
