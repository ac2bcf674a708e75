// SPDX-License-Identifier: GPL-3.0-or-later
// The persisted byte form of a signature: docs/signature-format.md. Never change it; add a version.
#pragma once

#include <cstddef>
#include <string>

#include "core/base/error.h"
#include "core/signature/signature.h"

namespace shapedb {

/// Little-endian on every machine; 56 + 48 bytes per point, with attributes 280 + 44 bytes per point (those
/// read from an earlier version 272: they are written in version 3).
[[nodiscard]] std::string encodeSignature(const Signature& signature);

/// The exact inverse for signatures from makeSignature. (With attributes, volume shares are not stored, since
/// they follow from the weights.) Errors: kMalformedSignature for a wrong length, magic, version or checksum,
/// or a number out of its range (the message says which).
[[nodiscard]] Result<Signature> decodeSignature(const std::string& bytes);
/// The same, into an existing signature whose memory is reused. After an error its contents are unspecified.
[[nodiscard]] Result<void> decodeSignature(const std::string& bytes, Signature& signature);

}  // namespace shapedb
