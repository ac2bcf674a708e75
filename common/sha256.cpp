// SPDX-License-Identifier: Apache-2.0
#include "common/sha256.h"

#include <new>

#include <openssl/evp.h>

namespace shapedb {

namespace {

// OpenSSL's digest calls fail only without memory: the algorithm is always built in.
void require(int ok) {
    if (ok != 1) throw std::bad_alloc();
}

// Fetched once: using EVP_sha256() looks it up by name every time, which takes as long as hashing some
// hundred bytes.
const EVP_MD* algorithm() {
    static const EVP_MD* const found = EVP_MD_fetch(nullptr, "SHA256", nullptr);
    return found != nullptr ? found : EVP_sha256();
}

}  // namespace

struct Sha256::Context {
    Context() : evp(EVP_MD_CTX_new()) {
        if (evp == nullptr) throw std::bad_alloc();
    }
    ~Context() { EVP_MD_CTX_free(evp); }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    EVP_MD_CTX* evp;
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
    require(EVP_DigestInit_ex(context_->evp, algorithm(), nullptr));
}

Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::update(const void* data, std::size_t size) {
    if (size > 0) require(EVP_DigestUpdate(context_->evp, data, size));
}

Sha256Digest Sha256::finish() {
    Sha256Digest digest{};
    require(EVP_DigestFinal_ex(context_->evp, digest.data(), nullptr));
    require(EVP_DigestInit_ex(context_->evp, algorithm(), nullptr));
    return digest;
}

Sha256Digest sha256(const void* data, std::size_t size) {
    Sha256Digest digest{};
    require(EVP_Digest(size > 0 ? data : "", size, digest.data(), nullptr, algorithm(), nullptr));
    return digest;
}

std::string toHex(const void* data, std::size_t size) {
    static constexpr char kDigits[] = "0123456789abcdef";
    const auto* bytes = static_cast<const unsigned char*>(data);
    std::string text;
    text.reserve(2 * size);
    for (std::size_t i = 0; i < size; ++i) {
        text.push_back(kDigits[bytes[i] >> 4]);
        text.push_back(kDigits[bytes[i] & 15]);
    }
    return text;
}

std::string toHex(const Sha256Digest& digest) { return toHex(digest.data(), digest.size()); }

}  // namespace shapedb
