// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/keyring.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::security {

namespace {

using std::chrono::milliseconds;

constexpr UnixMs kNever = std::numeric_limits<UnixMs>::max();
constexpr std::int64_t kDayMs = 86'400'000;
constexpr double kSecondMs = 1'000.0;
/// How long a change by another process may go unnoticed.
constexpr milliseconds kLookAgain{500};

std::int64_t dayOf(UnixMs time) { return time / kDayMs; }

tl::unexpected<Refusal> refuse(std::string message, milliseconds retryAfter) {
    return tl::make_unexpected(Refusal{{ErrorCode::kRateLimited, std::move(message)}, retryAfter});
}

/// Whether `used + wanted` goes beyond a limit that is set.
bool exceeds(std::uint64_t used, std::uint64_t wanted, std::uint64_t limit) {
    return limit > 0 && (wanted > limit || used > limit - wanted);
}

}  // namespace

Clock systemClock() {
    const auto since = [](auto now) {
        return std::chrono::duration_cast<milliseconds>(now.time_since_epoch());
    };
    return {[since] { return since(std::chrono::system_clock::now()).count(); },
            [since] { return since(std::chrono::steady_clock::now()); }};
}

KeyHolder::KeyHolder(Key key, KeyUsage usage)
    : key_(std::move(key)),
      revoked_(key_.revoked.value_or(kNever)),
      usage_(usage),
      tokens_(key_.spec.limits.callsPerSecond) {}

std::optional<UnixMs> KeyHolder::revoked() const {
    const UnixMs when = revoked_.load();
    return when == kNever ? std::nullopt : std::optional(when);
}

tl::expected<void, Refusal> KeyHolder::takeCall(milliseconds now) {
    const double rate = key_.spec.limits.callsPerSecond;
    if (rate == 0.0) return {};
    const std::lock_guard<std::mutex> lock(mutex_);
    const double elapsed = static_cast<double>((now - std::exchange(refilled_, now)).count());
    tokens_ = std::min(rate, tokens_ + std::max(0.0, elapsed) * rate / kSecondMs);
    if (tokens_ >= 1.0) {
        tokens_ -= 1.0;
        return {};
    }
    const auto wait = milliseconds(static_cast<std::int64_t>(std::ceil((1.0 - tokens_) * kSecondMs / rate)));
    return refuse("the API key '" + key_.spec.name + "' allows " +
                      std::to_string(key_.spec.limits.callsPerSecond) + " calls a second: try again later",
                  wait);
}

tl::expected<void, Refusal> KeyHolder::takeScan(std::uint64_t bytes, UnixMs now) {
    const std::lock_guard<std::mutex> lock(mutex_);
    beginDay(dayOf(now));
    const KeyLimits& limits = key_.spec.limits;
    const auto used = [&](const std::string& what) {
        return refuse("the API key '" + key_.spec.name + "' allows " + what +
                          " a day, and too few are left of today: try again after midnight UTC",
                      milliseconds((dayOf(now) + 1) * kDayMs - now));
    };
    if (exceeds(usage_.scans, 1, limits.scansPerDay)) {
        return used(std::to_string(limits.scansPerDay) + " scans");
    }
    if (exceeds(usage_.bytes, bytes, limits.bytesPerDay)) {
        return used(std::to_string(limits.bytesPerDay) + " bytes of points");
    }
    ++usage_.scans;
    usage_.bytes += bytes;
    return {};
}

void KeyHolder::giveBack(std::uint64_t bytes, UnixMs taken) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (usage_.day == dayOf(taken)) usage_.bytes -= std::min(bytes, usage_.bytes);
}

KeyUsage KeyHolder::usage(UnixMs now) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    beginDay(dayOf(now));
    return usage_;
}

void KeyHolder::beginDay(std::int64_t day) const {
    // A clock that is set back by a day does not give it anew; one that was years ahead must not take them
    // away.
    if (day > usage_.day || day + 1 < usage_.day) usage_ = {day, 0, 0};
}

Keyring::Keyring(std::unique_ptr<KeyStore> store, Clock clock, OnProblem onProblem)
    : store_(std::move(store)), clock_(std::move(clock)), onProblem_(std::move(onProblem)) {}

Result<void> Keyring::load() {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto usage = store_->usage();
    RETURN_IF_ERROR(usage);
    saved_ = std::move(*usage);
    return reload();
}

Result<void> Keyring::reload() {
    // The version first: a change in between is then seen again.
    const auto version = store_->version();
    RETURN_IF_ERROR(version);
    auto keys = store_->list();
    RETURN_IF_ERROR(keys);
    std::map<std::string, std::shared_ptr<KeyHolder>> holders;
    for (Key& key : *keys) {
        const std::string id = key.id;
        const auto known = holders_.find(id);
        if (known == holders_.end()) {
            const auto saved = saved_.find(id);
            const KeyUsage usage = saved == saved_.end() ? KeyUsage{} : saved->second;
            holders[id] = std::make_shared<KeyHolder>(std::move(key), usage);
        } else {
            if (key.revoked) known->second->revoke(*key.revoked);
            holders[id] = known->second;
        }
    }
    holders_ = std::move(holders);
    version_ = *version;
    return {};
}

void Keyring::lookForChanges() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        const milliseconds now = clock_.monotonic();
        if (now - looked_ < kLookAgain) return;
        looked_ = now;
    }
    // Without the lock: nobody else waits for the disk.
    const auto version = store_->version();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!version) return report(fail(version.error()));
    report(*version == version_ ? Result<void>() : reload());
}

void Keyring::report(const Result<void>& looked) {
    if (std::exchange(inTrouble_, !looked) != !looked) onProblem_(looked ? nullptr : &looked.error());
}

Result<CreatedKey> Keyring::create(const KeySpec& spec) {
    const UnixMs now = clock_.wall();
    RETURN_IF_ERROR(validate(spec, now));
    const auto made = makeApiKey();
    RETURN_IF_ERROR(made);
    Key key;
    key.id = made->id;
    key.spec = spec;
    key.secretSha256 = hashOf(*made);
    key.created = now;
    const std::lock_guard<std::mutex> lock(mutex_);
    RETURN_IF_ERROR(store_->insert(key));
    RETURN_IF_ERROR(reload());
    return CreatedKey{std::move(key), made->text()};
}

Result<std::vector<KeyStatus>> Keyring::list() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto keys = store_->list();
    RETURN_IF_ERROR(keys);
    RETURN_IF_ERROR(reload());
    std::vector<KeyStatus> all;
    for (const Key& key : *keys) {
        const auto holder = holders_.find(key.id);
        if (holder != holders_.end()) all.push_back({key, holder->second->usage(clock_.wall())});
    }
    return all;
}

Result<Key> Keyring::revoke(const std::string& idOrKey) {
    // If the whole key is given by mistake, its secret must not appear in an error or in the log.
    const auto whole = parseApiKey(idOrKey);
    const std::string& id = whole ? whole->id : idOrKey;
    const std::lock_guard<std::mutex> lock(mutex_);
    auto key = store_->revoke(id, clock_.wall());
    const auto holder = holderOf(id);
    if (!key && key.error().code != ErrorCode::kNotFound && holder && !holder->revoked()) {
        holder->revoke(clock_.wall());
        return fail(
            key.error().code,
            "the API key is refused from now on, but only until the server restarts: " + key.error().message);
    }
    RETURN_IF_ERROR(key);
    RETURN_IF_ERROR(reload());
    return key;
}

std::shared_ptr<KeyHolder> Keyring::holderOf(const std::string& id) const {
    const auto found = holders_.find(id);
    return found == holders_.end() ? nullptr : found->second;
}

Result<std::shared_ptr<KeyHolder>> Keyring::find(const std::string& presented) {
    const auto refused = [](std::string why) { return fail(ErrorCode::kUnauthenticated, std::move(why)); };
    const auto given = parseApiKey(presented);
    if (!given) return refused("this is no API key: one has the form shapedb_ID_SECRET");
    lookForChanges();
    std::shared_ptr<KeyHolder> holder;
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        holder = holderOf(given->id);
    }
    if (!holder || !equalInConstantTime(hashOf(*given), holder->key().secretSha256)) {
        return refused("unknown API key: check that it is complete and belongs to this server");
    }
    // Whoever knows the secret may know the rest.
    if (auto usable = usableNow(*holder); !usable) return fail(std::move(usable.error()));
    return holder;
}

Result<void> Keyring::usableNow(const KeyHolder& holder) const {
    const std::string named = "the API key '" + holder.key().spec.name + "' ";
    if (holder.revoked()) return fail(ErrorCode::kUnauthenticated, named + "was revoked");
    const auto& expires = holder.key().spec.expires;
    if (expires && clock_.wall() >= *expires) return fail(ErrorCode::kUnauthenticated, named + "has expired");
    return {};
}

Result<void> Keyring::requireUsable(const KeyHolder& holder) {
    lookForChanges();
    return usableNow(holder);
}

std::optional<Role> Keyring::highestUsableRole() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const UnixMs now = clock_.wall();
    std::optional<Role> highest;
    for (const auto& [id, holder] : holders_) {
        const Key& key = holder->key();
        if (holder->revoked() || !key.isUsable(now)) continue;
        highest = std::max(highest.value_or(key.spec.role), key.spec.role);
    }
    return highest;
}

Result<void> Keyring::saveUsage() {
    std::map<std::string, KeyUsage> changed;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, holder] : holders_) {
        const KeyUsage usage = holder->usage(clock_.wall());
        const KeyUsage& saved = saved_[id];
        if (usage.scans == 0 ||
            (usage.day == saved.day && usage.scans == saved.scans && usage.bytes == saved.bytes)) {
            continue;
        }
        changed[id] = usage;
    }
    if (changed.empty()) return {};
    RETURN_IF_ERROR(store_->saveUsage(changed));
    for (const auto& [id, usage] : changed) saved_[id] = usage;
    return {};
}

namespace {

constexpr std::chrono::seconds kSaveEvery{10};

}  // namespace

UsageSaver::UsageSaver(Keyring& keyring, telemetry::LoggerPtr log)
    : keyring_(keyring), log_(std::move(log)), thread_(std::in_place, kSaveEvery, [this] { save(); }) {}

UsageSaver::~UsageSaver() {
    thread_.reset();
    save();
}

void UsageSaver::save() {
    const auto saved = keyring_.saveUsage();
    if (!saved && !failing_) {
        log_->error("what API keys have used cannot be stored", telemetry::fieldsOf(saved.error()));
    }
    failing_ = !saved;
}

}  // namespace shapedb::security
