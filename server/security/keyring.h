// SPDX-License-Identifier: GPL-3.0-or-later
// The API keys of a server: who presents which, and how much each has used.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/repeating_thread.h"
#include "core/base/error.h"
#include "server/security/key.h"
#include "server/security/key_store.h"
#include "server/telemetry/logger.h"

namespace shapedb::security {

/// Why a caller is refused, and when it may try again.
struct Refusal {
    Error error;
    std::chrono::milliseconds retryAfter{0};
};

/// Both clocks of this process; tests have their own.
struct Clock {
    std::function<UnixMs()> wall;                          ///< the system's time
    std::function<std::chrono::milliseconds()> monotonic;  ///< never goes back
};
[[nodiscard]] Clock systemClock();

/// A key in use, with what it has used. Thread-safe.
class KeyHolder {
  public:
    KeyHolder(Key key, KeyUsage usage);

    /// As it was made.
    [[nodiscard]] const Key& key() const { return key_; }
    [[nodiscard]] std::optional<UnixMs> revoked() const;
    void revoke(UnixMs when) { revoked_ = when; }

    /// Takes one call off its rate (a token bucket that holds the calls of one second). Errors: kRateLimited.
    [[nodiscard]] tl::expected<void, Refusal> takeCall(std::chrono::milliseconds now);
    /// Counts one scan of `bytes` bytes, or nothing at all if that is more than is left of the day. Errors:
    /// kRateLimited, until midnight UTC.
    [[nodiscard]] tl::expected<void, Refusal> takeScan(std::uint64_t bytes, UnixMs now);
    /// Bytes that were taken at `taken` and did not arrive, if that day lasts.
    void giveBack(std::uint64_t bytes, UnixMs taken);
    /// Of the day of `now`.
    [[nodiscard]] KeyUsage usage(UnixMs now) const;

  private:
    void beginDay(std::int64_t day) const;

    const Key key_;
    std::atomic<UnixMs> revoked_;  ///< kNever: it was not
    mutable std::mutex mutex_;
    mutable KeyUsage usage_;
    double tokens_;
    std::chrono::milliseconds refilled_{0};
};

struct KeyStatus {
    Key key;
    KeyUsage today;
};

struct CreatedKey {
    Key key;
    std::string text;  ///< the whole key; nobody can read it again
};

/// Thread-safe.
class Keyring {
  public:
    /// Called with an error when the stored keys can no longer be read, and with null when they can again.
    using OnProblem = std::function<void(const Error* problem)>;
    explicit Keyring(
        std::unique_ptr<KeyStore> store, Clock clock = systemClock(),
        OnProblem onProblem = [](const Error*) {});

    /// Reads the keys. Call once, first. Errors of this and the next three: those of KeyStore.
    [[nodiscard]] Result<void> load();
    /// Errors: kInvalidArgument, as `validate`.
    [[nodiscard]] Result<CreatedKey> create(const KeySpec& spec);
    /// The oldest first.
    [[nodiscard]] Result<std::vector<KeyStatus>> list();
    /// By its id, or the whole key. Nobody can use the key from now on; after an error of the store this
    /// holds until the server restarts. Errors: kNotFound (there is none, or it was revoked before).
    [[nodiscard]] Result<Key> revoke(const std::string& idOrKey);

    /// Who presents `presented`. Keys that another process has made or revoked count within a second.
    /// While the store cannot be read those that are known count. Errors: kUnauthenticated (no such key,
    /// revoked, expired).
    [[nodiscard]] Result<std::shared_ptr<KeyHolder>> find(const std::string& presented);
    /// Whether who presented this key may still use it. Errors: kUnauthenticated (revoked or expired since).
    [[nodiscard]] Result<void> requireUsable(const KeyHolder& holder);
    /// The highest role of the keys that can be used; nothing if there is none.
    [[nodiscard]] std::optional<Role> highestUsableRole() const;
    [[nodiscard]] const Clock& clock() const { return clock_; }

    /// Writes what has been used since the last time; call now and then. A process that dies loses what it
    /// has not written. Errors: those of KeyStore.
    [[nodiscard]] Result<void> saveUsage();

  private:
    Result<void> reload();
    Result<void> usableNow(const KeyHolder& holder) const;
    void lookForChanges();
    void report(const Result<void>& looked);
    std::shared_ptr<KeyHolder> holderOf(const std::string& id) const;

    const std::unique_ptr<KeyStore> store_;
    const Clock clock_;
    mutable std::mutex mutex_;
    std::map<std::string, std::shared_ptr<KeyHolder>> holders_;  ///< by id
    std::map<std::string, KeyUsage> saved_;
    std::int64_t version_ = 0;
    std::chrono::milliseconds looked_{0};
    const OnProblem onProblem_;
    bool inTrouble_ = false;
};

/// Writes what API keys have used: saves every ten seconds while it lives, and once more when it is
/// destroyed.
class UsageSaver {
  public:
    /// `keyring` must outlive this.
    UsageSaver(Keyring& keyring, telemetry::LoggerPtr log);
    ~UsageSaver();
    UsageSaver(const UsageSaver&) = delete;
    UsageSaver& operator=(const UsageSaver&) = delete;

  private:
    void save();

    Keyring& keyring_;
    const telemetry::LoggerPtr log_;
    bool failing_ = false;  ///< reported once
    std::optional<RepeatingThread> thread_;
};

}  // namespace shapedb::security
