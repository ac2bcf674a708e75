// SHA-256 for the checksum of points (on the wire and in the database) and for the
// fingerprints the store keeps. Used by server/ and client/, so that both mean the same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace shapedb {

using Sha256Digest = std::array<std::uint8_t, 32>;

/// The digest of `size` bytes at `data` (which may be null when size is 0).
/// Throws std::bad_alloc, nothing else. Thread-safe.
Sha256Digest sha256(const void* data, std::size_t size);

/// 64 lower-case hexadecimal digits.
std::string toHex(const Sha256Digest& digest);

/// The same digest over pieces that arrive one after another. Not thread-safe: one per
/// thread. Movable, not copyable. The constructor throws std::bad_alloc, nothing else.
class Sha256 {
  public:
    Sha256();
    ~Sha256();
    Sha256(Sha256&&) noexcept;
    Sha256& operator=(Sha256&&) noexcept;

    /// Appends `size` bytes; null is allowed when size is 0.
    void update(const void* data, std::size_t size);

    /// The digest of all pieces since the start or since the last `finish`; afterwards
    /// the object is as new.
    Sha256Digest finish();

  private:
    struct Context;
    std::unique_ptr<Context> context_;
};

}  // namespace shapedb
