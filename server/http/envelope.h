// SPDX-License-Identifier: GPL-3.0-or-later
// The Connect protocol's envelopes: each message of a stream is one byte of flags, its length in four bytes
// (big-endian), and its bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/failure.h"

namespace shapedb::http {

constexpr std::uint8_t kPlainMessage = 0;
/// The message is no message of the service: it ends a stream of answers.
constexpr std::uint8_t kEndOfStream = 2;

/// `message` in its envelope. At most 4 GiB - 1 byte.
[[nodiscard]] std::string inEnvelope(std::uint8_t flags, std::string_view message);

/// Takes the messages of a request out of their envelopes, however its bytes arrive. Memory is taken for
/// bytes that have come, not for those announced. Used by one thread.
class EnvelopeReader {
  public:
    /// `mostBytes`: of one message.
    explicit EnvelopeReader(std::size_t mostBytes) : mostBytes_(mostBytes) {}

    /// Appends the messages that these bytes complete to `complete`. Fails if an envelope has flags that a
    /// request does not have, compression among them, or announces a longer message; nothing more can be read
    /// then.
    [[nodiscard]] OrFailure<void> add(std::string_view bytes, std::vector<std::string>& complete);
    /// Whether the last message is complete.
    [[nodiscard]] bool between() const { return head_.empty(); }

  private:
    OrFailure<void> readHead();

    const std::size_t mostBytes_;
    std::string head_;  ///< as much of an envelope's first bytes as there is
    std::string message_;
    std::size_t missing_ = 0;  ///< bytes of the message yet to come, once the head is complete
};

}  // namespace shapedb::http
