// SPDX-License-Identifier: Apache-2.0
// SHA-256: the checksum of points on the wire and in the database, and of backups.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace shapedb {

using Sha256Digest = std::array<std::uint8_t, 32>;

/// `data` may be null if `size` is 0. Throws only std::bad_alloc. Thread-safe.
Sha256Digest sha256(const void* data, std::size_t size);

/// Two lower-case hexadecimal digits per byte.
std::string toHex(const void* data, std::size_t size);
std::string toHex(const Sha256Digest& digest);

/// The digest of data that arrives in pieces. Movable, not copyable; not thread-safe. The constructor throws
/// only std::bad_alloc.
class Sha256 {
  public:
    Sha256();
    ~Sha256();
    Sha256(Sha256&&) noexcept;
    Sha256& operator=(Sha256&&) noexcept;

    /// `data` may be null if `size` is 0.
    void update(const void* data, std::size_t size);

    /// The digest of everything since the last `finish`; the object can then be used again.
    Sha256Digest finish();

  private:
    struct Context;
    std::unique_ptr<Context> context_;
};

}  // namespace shapedb
