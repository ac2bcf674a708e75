// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a call is allowed: one check for all operations, whatever the transport.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "server/security/keyring.h"
#include "server/security/operation.h"

namespace shapedb::security {

/// What a transport knows of its caller.
struct Credentials {
    std::string key;          ///< as presented; empty: none
    bool localAdmin = false;  ///< came through the server's Unix socket, which only its owner can open
};

/// The rules of one server. Thread-safe.
struct AccessPolicy {
    Keyring& keyring;
    /// Without: a caller that presents no key may do everything but what concerns keys.
    bool keysRequired = true;
};

/// One call: who makes it, and what it may do. Used by one thread. The references must outlive it.
class Authorization {
  public:
    Authorization(const AccessPolicy& policy, const Operation& operation)
        : policy_(policy), operation_(operation) {}

    /// First of all. A key that is presented counts, also where none is required. Errors: kUnauthenticated;
    /// kPermissionDenied (the role, or the operation concerns all collections); kRateLimited; those of
    /// KeyStore.
    [[nodiscard]] Result<void> begin(const Credentials& credentials);
    /// Before anything of the collection is read or changed. Errors: kPermissionDenied, whether or not the
    /// collection exists.
    [[nodiscard]] Result<void> useCollection(const std::string& name);
    /// The same for all collections, those to come too. Errors: kPermissionDenied, which names none.
    [[nodiscard]] Result<void> useAllCollections();
    /// Whether the caller may know of the collection.
    [[nodiscard]] bool sees(const std::string& collection) const;
    /// To be called before a scan of this many bytes is received. Errors: kRateLimited.
    [[nodiscard]] Result<void> useScan(std::uint64_t bytes);
    /// At the end of the call: of what was announced only the bytes that arrived count.
    void endScans(std::uint64_t arrived);

    /// Again, while a stream lasts and before what it sent is stored: a key that was revoked or has expired
    /// since `begin` stores nothing any more. Cheap. Errors: kUnauthenticated.
    [[nodiscard]] Result<void> requireStill() const;
    /// requireStill for another thread; may outlive this. Empty for a caller without a key. Valid from
    /// `begin` on.
    [[nodiscard]] std::function<Result<void>()> stillAllowed() const;

    /// At the end of a call: `result`, unless a collection should have been asked for and never was: a
    /// mistake of ours, and nobody's answer.
    [[nodiscard]] Result<void> settle(Result<void> result) const;
    /// After kRateLimited: when the caller may try again.
    [[nodiscard]] std::optional<std::chrono::milliseconds> retryAfter() const { return retryAfter_; }

    /// For logs: the id and name of the key, "" without one; valid from `begin` on, also after an error if
    /// the key is known.
    [[nodiscard]] std::string keyId() const { return holder_ ? holder_->key().id : std::string(); }
    [[nodiscard]] std::string keyName() const { return holder_ ? holder_->key().spec.name : std::string(); }

  private:
    Result<void> authenticate(const Credentials& credentials);
    Result<void> requireRole() const;
    Result<void> spend(tl::expected<void, Refusal> taken);

    const AccessPolicy& policy_;
    const Operation& operation_;
    std::shared_ptr<KeyHolder> holder_;  ///< null: a caller without a key, who may do everything
    bool usedCollection_ = false;
    std::uint64_t announced_ = 0;  ///< bytes of scans, counted before they came
    UnixMs announcedAt_ = 0;       ///< the last of them
    std::optional<std::chrono::milliseconds> retryAfter_;
};

}  // namespace shapedb::security
