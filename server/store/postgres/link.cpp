// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/link.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <utility>

#include <libpq-fe.h>
#include <poll.h>

namespace shapedb::store {

namespace {

/// What the database takes for a time.
constexpr std::int64_t kLongestLockMs = 2'147'483'647;

constexpr int kBinary = 1;
constexpr char kConflict[] = "another transaction was in the way (SQLSTATE ";
constexpr char kHeldUp[] = "another transaction has held up this one in the database for too long (SQLSTATE ";
constexpr char kLockTimeoutState[] = "55P03";

/// Before the state in the messages of conflicts: see isConflict.
bool isConflictState(const std::string& state) { return state == "40001" || state == "40P01"; }

ErrorCode codeOf(const std::string& state) {
    if (state == "53100") return ErrorCode::kStorageFull;
    if (state == "53200") return ErrorCode::kOutOfMemory;
    if (state == "57014") return ErrorCode::kCancelled;
    if (state == "XX001" || state == "XX002") return ErrorCode::kDataLoss;
    if (state == "25006") return ErrorCode::kUnavailable;  // a standby
    if (state == "25P03") return ErrorCode::kUnavailable;  // its transaction was idle for too long
    if (state == kLockTimeoutState) return ErrorCode::kUnavailable;
    const std::string kind = state.substr(0, 2);
    // No connection; too many of them; shut down, or starting.
    if (kind == "08" || kind == "53" || kind == "57" || kind == "40") return ErrorCode::kUnavailable;
    // The store checks before it writes, so a broken constraint is its own mistake.
    if (kind == "22" || kind == "23" || kind == "42") return ErrorCode::kInternal;
    return ErrorCode::kStorage;
}

std::string trimmed(const char* message) {
    std::string text = message != nullptr ? message : "";
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.pop_back();
    for (const char blank : {'\n', '\t'}) std::replace(text.begin(), text.end(), blank, ' ');
    return text;
}

}  // namespace

bool isConflict(const Failure& failure) noexcept { return failure.error.message.rfind(kConflict, 0) == 0; }

bool isHeldUp(const Failure& failure) noexcept { return failure.error.message.rfind(kHeldUp, 0) == 0; }

void PostgresResultCloser::operator()(pg_result* result) const noexcept { PQclear(result); }

void PostgresLink::BufferCloser::operator()(char* buffer) const noexcept { PQfreemem(buffer); }

PostgresLink::PostgresLink(const PostgresAddress& address) : patience_(address.patience) {
    const auto seconds =
        std::max<std::int64_t>(1, std::chrono::duration_cast<std::chrono::seconds>(patience_).count());
    const std::string timeout = std::to_string(seconds);
    // The database ends a wait for a lock before this side gives up: a transaction of which nobody knows any
    // more would go on waiting there, and one more for each call that is tried again.
    const auto lockMs = std::max<std::int64_t>(1, patience_.count() - patience_.count() / 10);
    // What is read to an end is not worth compiling, and the first rows of a page still less.
    const std::string session =
        "-c search_path=public -c timezone=UTC -c extra_float_digits=3 -c jit=off "
        "-c lock_timeout=" +
        std::to_string(std::min(lockMs, kLongestLockMs));
    std::vector<std::pair<const char*, const char*>> options = {
        // The URI may say otherwise: what comes before it is for what it does not mention.
        {"connect_timeout", timeout.c_str()},
        // A host that has gone without a word is noticed while the connection is idle, too.
        {"keepalives_idle", "10"},
        {"keepalives_interval", "5"},
        {"keepalives_count", "3"},
        {"dbname", address.uri.c_str()},
        {"application_name", address.serverName.c_str()},
        {"client_encoding", "UTF8"},
        {"options", session.c_str()},
    };
    if (!address.password.empty()) options.emplace_back("password", address.password.c_str());
    std::vector<const char*> names;
    std::vector<const char*> values;
    for (const auto& [name, value] : options) {
        names.push_back(name);
        values.push_back(value);
    }
    names.push_back(nullptr);
    values.push_back(nullptr);
    constexpr int kExpandUri = 1;
    connection_ = PQconnectdbParams(names.data(), values.data(), kExpandUri);
    if (connection_ == nullptr) throw std::bad_alloc();
    if (PQstatus(connection_) != CONNECTION_OK || PQsetnonblocking(connection_, 1) != 0) {
        const std::string why = trimmed(PQerrorMessage(connection_));
        PQfinish(connection_);
        throw Failure(ErrorCode::kUnavailable, "the database cannot be reached: " + why, false);
    }
    // Warnings and notices are for people at a terminal.
    PQsetNoticeReceiver(
        connection_, [](void*, const PGresult*) {}, nullptr);
}

PostgresLink::~PostgresLink() { PQfinish(connection_); }

bool PostgresLink::isBroken() const noexcept {
    return timedOut_ || PQstatus(connection_) != CONNECTION_OK ||
           PQtransactionStatus(connection_) == PQTRANS_UNKNOWN;
}

bool PostgresLink::isInTransaction() const noexcept {
    return PQtransactionStatus(connection_) == PQTRANS_INTRANS;
}

bool PostgresLink::isIdle() const noexcept { return PQtransactionStatus(connection_) == PQTRANS_IDLE; }

void PostgresLink::raiseConnection(const std::string& what) const {
    throw Failure(
        ErrorCode::kUnavailable,
        "the connection to the database failed (" + what + "): " + trimmed(PQerrorMessage(connection_)),
        false);
}

void PostgresLink::raiseResult(const pg_result* result) const {
    const char* field = PQresultErrorField(result, PG_DIAG_SQLSTATE);
    const std::string state = field != nullptr ? field : "";
    const std::string primary = trimmed(PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY));
    if (state.empty()) {
        throw Failure(ErrorCode::kUnavailable,
                      "the connection to the database failed: " + trimmed(PQresultErrorMessage(result)),
                      false);
    }
    if (isConflictState(state)) throw Failure(ErrorCode::kUnavailable, kConflict + state + ")", false);
    const ErrorCode code = codeOf(state);
    if (state == kLockTimeoutState) {
        raise(code, kHeldUp + state + ")");
    }
    throw Failure(code, "the database says: " + primary + " (SQLSTATE " + state + ")", true);
}

void PostgresLink::waitForSocket(bool writable, Clock::time_point until) {
    while (true) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
        if (left <= 0) {
            timedOut_ = true;
            raise(ErrorCode::kUnavailable,
                  "the database has not answered for " + std::to_string(patience_.count() / 1000) + " s");
        }
        pollfd entry{PQsocket(connection_), static_cast<short>(writable ? POLLIN | POLLOUT : POLLIN), 0};
        const int ready = ::poll(&entry, 1, static_cast<int>(std::min<std::int64_t>(left, 1'000)));
        if (ready > 0) return;
        if (ready < 0 && errno != EINTR) raiseConnection("wait");
    }
}

void PostgresLink::waitForInput(Clock::time_point until) {
    waitForSocket(false, until);
    if (PQconsumeInput(connection_) == 0) raiseConnection("receive");
}

void PostgresLink::flush(Clock::time_point until) {
    while (true) {
        const int left = PQflush(connection_);
        if (left == 0) return;
        if (left < 0) raiseConnection("send");
        waitForSocket(true, until);
        if (PQconsumeInput(connection_) == 0) raiseConnection("receive");
    }
}

PostgresResult PostgresLink::nextResult(Clock::time_point until) {
    while (PQisBusy(connection_) != 0) waitForInput(until);
    return PostgresResult(PQgetResult(connection_));
}

PostgresResult PostgresLink::await() {
    const auto until = Clock::now() + patience_;
    flush(until);
    PostgresResult last;
    PostgresResult failed;
    while (true) {
        PostgresResult next = nextResult(until);
        if (next == nullptr) break;
        const auto status = PQresultStatus(next.get());
        isCopying_ = status == PGRES_COPY_OUT;
        if (isCopying_) return next;
        const bool ok =
            status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK || status == PGRES_EMPTY_QUERY;
        if (!ok && failed == nullptr) failed = std::move(next);
        if (ok) last = std::move(next);
        if (PQstatus(connection_) != CONNECTION_OK) break;
    }
    if (failed != nullptr) raiseResult(failed.get());
    if (last == nullptr) raiseConnection("receive");
    return last;
}

PostgresResult PostgresLink::sent(int accepted, const char* what) {
    if (accepted == 0) raiseConnection(what);
    return await();
}

PostgresResult PostgresLink::query(const std::string& sql) {
    endCopy();
    return sent(PQsendQuery(connection_, sql.c_str()), "send a statement");
}

PostgresResult PostgresLink::rows(const std::string& sql) {
    endCopy();
    return sent(PQsendQueryParams(connection_, sql.c_str(), 0, nullptr, nullptr, nullptr, nullptr, kBinary),
                "fetch rows");
}

PostgresResult PostgresLink::prepare(const std::string& name, const std::string& sql) {
    endCopy();
    return sent(PQsendPrepare(connection_, name.c_str(), sql.c_str(), 0, nullptr), "prepare");
}

PostgresResult PostgresLink::describe(const std::string& name) {
    endCopy();
    return sent(PQsendDescribePrepared(connection_, name.c_str()), "prepare");
}

PostgresResult PostgresLink::execute(const std::string& name, const std::vector<BlobView>& values) {
    endCopy();
    std::vector<const char*> data;
    std::vector<int> sizes;
    for (const BlobView& value : values) {
        data.push_back(static_cast<const char*>(value.data));
        sizes.push_back(static_cast<int>(value.size));
    }
    const std::vector<int> formats(values.size(), kBinary);
    return sent(PQsendQueryPrepared(connection_, name.c_str(), static_cast<int>(values.size()), data.data(),
                                    sizes.data(), formats.data(), kBinary),
                "send a statement");
}

void PostgresLink::startCopy(const std::string& sql) { query(sql); }

bool PostgresLink::nextOfCopy(BlobView& row) {
    if (!isCopying_) return false;
    const auto until = Clock::now() + patience_;
    constexpr int kNotBlocking = 1;
    while (true) {
        char* buffer = nullptr;
        const int size = PQgetCopyData(connection_, &buffer, kNotBlocking);
        copied_.reset(buffer);
        if (size > 0) {
            row = {buffer, static_cast<std::size_t>(size)};
            return true;
        }
        if (size == 0) {
            waitForInput(until);
            continue;
        }
        isCopying_ = false;
        if (size < -1) raiseConnection("receive");
        static_cast<void>(await());  // whether all of it was sent
        return false;
    }
}

void PostgresLink::endCopy() {
    BlobView row;
    while (nextOfCopy(row)) {
    }
}

Result<void> checkUri(const std::string& uri) {
    char* why = nullptr;
    const std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)> parsed(
        PQconninfoParse(uri.c_str(), &why), PQconninfoFree);
    const std::unique_ptr<char, void (*)(void*)> message(why, PQfreemem);
    if (parsed == nullptr) {
        return fail(ErrorCode::kInvalidArgument, "the URI of the database cannot be read");
    }
    for (const PQconninfoOption* option = parsed.get(); option->keyword != nullptr; ++option) {
        const std::string keyword = option->keyword;
        const bool isSecret = keyword == "password" || keyword == "sslpassword";
        if (isSecret && option->val != nullptr && *option->val != '\0') {
            return fail(
                ErrorCode::kInvalidArgument,
                "the URI of the database holds a password: put it into a file (postgres.password_file), or "
                "into PGPASSWORD");
        }
    }
    return {};
}

}  // namespace shapedb::store
