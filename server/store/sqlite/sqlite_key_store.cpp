// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/sqlite_key_store.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/security/keyring.h"
#include "server/store/failure.h"
#include "server/store/sqlite/connection.h"
#include "server/store/sqlite/migrator.h"

namespace shapedb::store {
namespace {

using security::Key;
using security::KeyUsage;
using security::UnixMs;

constexpr int kBusyTimeoutMs = 5'000;

#define KEY_COLUMNS                                                                                \
    "id, name, role, secret_sha256, collections, calls_per_second, scans_per_day, bytes_per_day, " \
    "created_at, "                                                                                 \
    "expires_at, revoked_at"
constexpr char kInsertKey[] =
    "INSERT INTO api_key (" KEY_COLUMNS ") VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, NULL, NULL)";
constexpr char kSetKeyExpiry[] = "UPDATE api_key SET expires_at = ?2 WHERE id = ?1";
constexpr char kListKeys[] = "SELECT " KEY_COLUMNS " FROM api_key ORDER BY created_at, id";
constexpr char kKeyById[] = "SELECT " KEY_COLUMNS " FROM api_key WHERE id = ?1";
constexpr char kRevokeKey[] = "UPDATE api_key SET revoked_at = ?2 WHERE id = ?1 AND revoked_at IS NULL";
constexpr char kListUsage[] = "SELECT key_id, day, scans, bytes FROM api_key_usage";
constexpr char kSaveUsage[] =
    "INSERT INTO api_key_usage (key_id, day, scans, bytes) VALUES (?1, ?2, ?3, ?4) "
    "ON CONFLICT (key_id) DO UPDATE SET day = excluded.day, scans = excluded.scans, bytes = excluded.bytes";
#undef KEY_COLUMNS
constexpr char kReadVersion[] = "PRAGMA data_version";

/// No backup holds keys.
std::string remedyFor(const std::string& path) {
    return "move '" + path + "' away and make new keys with 'shapedbd key create'";
}

std::string joinLines(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
}

std::vector<std::string> splitLines(const std::string& text) {
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        lines.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return lines;
}

std::optional<UnixMs> timeOrNull(const Query& row, int column) {
    return row.isNull(column) ? std::nullopt : std::optional<UnixMs>(row.integer(column));
}

Key readKey(const Query& row) {
    Key key;
    key.id = row.text(0);
    key.spec.name = row.text(1);
    key.spec.role = static_cast<security::Role>(row.integer(2));
    const BlobView hash = row.blob(3);
    std::memcpy(key.secretSha256.data(), hash.data, std::min(hash.size, key.secretSha256.size()));
    key.spec.collections = splitLines(row.text(4));
    key.spec.limits.callsPerSecond = static_cast<std::uint32_t>(row.integer(5));
    key.spec.limits.scansPerDay = static_cast<std::uint64_t>(row.integer(6));
    key.spec.limits.bytesPerDay = static_cast<std::uint64_t>(row.integer(7));
    key.created = row.integer(8);
    key.spec.expires = timeOrNull(row, 9);
    key.revoked = timeOrNull(row, 10);
    return key;
}

/// SQLite would create it with the permissions of the umask.
void createPrivateFile(const std::string& path) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR);
    if (descriptor < 0) {
        raise(errno == ENOSPC ? ErrorCode::kStorageFull : ErrorCode::kStorage,
              "the file of API keys '" + path + "' cannot be opened: " + std::strerror(errno));
    }
    ::close(descriptor);
}

class SqliteKeyStore final : public security::KeyStore {
  public:
    explicit SqliteKeyStore(const std::string& path) : path_(path) {
        createPrivateFile(path);
        open();
        if (identify(*connection_) == FileKind::kForeign) {
            raise(ErrorCode::kDataLoss, "'" + path + "' is not a file of API keys");
        }
        migrate(*connection_, embeddedKeyMigrations(), security::systemClock().wall());
        watched_ = watch_->integer(kReadVersion);
    }

    Result<void> insert(const Key& key) override {
        return locked("store the API key", [&] {
            Transaction transaction(*connection_, Transaction::Kind::kWrite);
            const BlobView hash{key.secretSha256.data(), key.secretSha256.size()};
            Query(*connection_, kInsertKey, key.id, key.spec.name, static_cast<int>(key.spec.role), hash,
                  joinLines(key.spec.collections), key.spec.limits.callsPerSecond,
                  key.spec.limits.scansPerDay, key.spec.limits.bytesPerDay, key.created)
                .run();
            if (key.spec.expires) Query(*connection_, kSetKeyExpiry, key.id, *key.spec.expires).run();
            transaction.commit();
        });
    }

    Result<std::vector<Key>> list() override {
        return locked("read the API keys", [&] {
            std::vector<Key> keys;
            Query rows(*connection_, kListKeys);
            while (rows.step()) keys.push_back(readKey(rows));
            return keys;
        });
    }

    Result<Key> revoke(const std::string& id, UnixMs now) override {
        return locked("revoke the API key", [&] {
            Transaction transaction(*connection_, Transaction::Kind::kWrite);
            Query(*connection_, kRevokeKey, id, now).run();
            if (connection_->changes() == 0) {
                raise(ErrorCode::kNotFound, "there is no API key " + quoted(id) + " that is not revoked");
            }
            Key key;
            {
                Query row(*connection_, kKeyById, id);
                row.step();
                key = readKey(row);
            }
            transaction.commit();
            return key;
        });
    }

    Result<std::int64_t> version() override {
        return locked("look for changed API keys", [&]() -> std::int64_t {
            try {
                const std::int64_t now = watch_->integer(kReadVersion);
                if (std::exchange(watched_, now) != now) ++version_;
            } catch (const Failure& failure) {
                // Another process is writing: what it does is seen the next time.
                if (failure.error.code != ErrorCode::kStorage) throw;
            }
            return version_;
        });
    }

    Result<std::map<std::string, KeyUsage>> usage() override {
        return locked("read the use of API keys", [&] {
            std::map<std::string, KeyUsage> all;
            Query rows(*connection_, kListUsage);
            while (rows.step()) {
                all[rows.text(0)] = {rows.integer(1), static_cast<std::uint64_t>(rows.integer(2)),
                                     static_cast<std::uint64_t>(rows.integer(3))};
            }
            return all;
        });
    }

    Result<void> saveUsage(const std::map<std::string, KeyUsage>& usage) override {
        return locked("store the use of API keys", [&] {
            Transaction transaction(*connection_, Transaction::Kind::kWrite);
            for (const auto& [id, used] : usage) {
                Query(*connection_, kSaveUsage, id, used.day, used.scans, used.bytes).run();
            }
            transaction.commit();
        });
    }

  private:
    template <typename Body>
    auto locked(const char* operation, Body&& body) -> Result<std::invoke_result_t<Body>> {
        const std::lock_guard<std::mutex> lock(mutex_);
        return guarded(operation, [&] {
            return withRemedy(remedyFor(path_), [&] {
                followFile();
                return body();
            });
        });
    }

    void open() {
        struct stat status {};
        if (::stat(path_.c_str(), &status) != 0) raiseGone();
        inode_ = status.st_ino;
        device_ = status.st_dev;
        connection_ = std::make_unique<SqliteConnection>(path_, OpenMode::kReadWrite, kBusyTimeoutMs);
        watch_ = std::make_unique<SqliteConnection>(path_, OpenMode::kReadOnly, 0);
    }

    /// An operator may put another file in its place, a copy that was saved for instance.
    void followFile() {
        struct stat status {};
        if (::stat(path_.c_str(), &status) != 0) raiseGone();
        if (status.st_ino == inode_ && status.st_dev == device_) return;
        open();
        ++version_;
    }

    [[noreturn]] void raiseGone() const {
        raise(ErrorCode::kStorage, "the file of API keys '" + path_ + "' is gone: put it back");
    }

    const std::string path_;
    std::mutex mutex_;
    std::unique_ptr<SqliteConnection> connection_;
    std::unique_ptr<SqliteConnection> watch_;  ///< waits for nobody
    ino_t inode_ = 0;
    dev_t device_ = 0;
    std::int64_t watched_ = 0;  ///< SQLite's number for the changes of others
    std::int64_t version_ = 0;
};

}  // namespace

Result<std::unique_ptr<security::KeyStore>> openSqliteKeyStore(const std::string& path) {
    return guarded("open the API keys", [&]() -> std::unique_ptr<security::KeyStore> {
        return withRemedy(remedyFor(path), [&] { return std::make_unique<SqliteKeyStore>(path); });
    });
}

}  // namespace shapedb::store
