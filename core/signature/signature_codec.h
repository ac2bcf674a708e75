// The persisted byte form of a signature. docs/signature-format.md describes it; the
// numbers below are persisted: never change them, add a version.
#pragma once

#include <cstddef>
#include <string>

#include "core/base/error.h"
#include "core/signature/signature.h"

namespace shapedb {

/// Little-endian on every machine; 56 + 48 bytes a point; with attributes 488 + 44 bytes a point: at most
/// 1016 bytes with the 12 points of the default profile.
[[nodiscard]] std::string encodeSignature(const Signature& signature);

/// The exact inverse for signatures as makeSignature makes them (with attributes, the volume shares
/// are not stored: they follow from the weights). Errors: kMalformedSignature (too short or long, wrong
/// magic, unknown version, checksum, a number out of its range: the message says which).
[[nodiscard]] Result<Signature> decodeSignature(const std::string& bytes);
/// The same into a signature that may hold anything; what it has allocated is used again. After an error
/// it holds anything.
[[nodiscard]] Result<void> decodeSignature(const std::string& bytes, Signature& signature);

}  // namespace shapedb
