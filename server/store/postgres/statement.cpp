// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/statement.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <libpq-fe.h>

namespace shapedb::store {

namespace {

// Types of the database, as in its catalogue.
constexpr Oid kBool = 16, kInt8 = 20, kInt2 = 21, kInt4 = 23, kText = 25, kFloat8 = 701;

/// Rows that are in memory at a time, of statements that may find any number.
constexpr int kRowsAtATime = 256;

constexpr char kCopy[] = "COPY (";
constexpr char kToStdout[] = ") TO STDOUT (FORMAT binary)";
/// What a binary copy begins with: 11 bytes that are always the same, flags, and the length of more to skip.
constexpr std::size_t kCopyHeader = 19;
constexpr std::size_t kEndOfCopy = 0xffff;  // in place of the number of columns
constexpr std::size_t kNull = 0xffffffff;   // in place of the length of a column

/// ?1 as $1. No text of ours has a question mark elsewhere.
std::string withDollars(std::string sql) {
    std::replace(sql.begin(), sql.end(), '?', '$');
    return sql;
}

bool mayFindMany(const std::string& sql) {
    const bool isLocking = sql.find("FOR UPDATE") != std::string::npos;
    return sql.rfind("SELECT", 0) == 0 && sql.find("ORDER BY") != std::string::npos && !isLocking;
}

std::string bigEndian(std::uint64_t value, std::size_t bytes) {
    std::string text(bytes, '\0');
    for (std::size_t i = bytes; i-- > 0; value >>= 8) text[i] = static_cast<char>(value & 0xff);
    return text;
}

std::uint64_t fromBigEndian(const char* data, std::size_t bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<unsigned char>(data[i]);
    return value;
}

double realOf(std::uint64_t bits) {
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// A number in the binary form of its type.
std::int64_t integerOf(Oid type, const BlobView& value) {
    const std::uint64_t bits = fromBigEndian(static_cast<const char*>(value.data), value.size);
    switch (type) {
        case kInt8: return static_cast<std::int64_t>(bits);
        case kInt4: return static_cast<std::int32_t>(bits);
        case kInt2: return static_cast<std::int16_t>(bits);
        case kBool: return static_cast<std::int64_t>(bits);
        default: raise(ErrorCode::kInternal, "a column of another type is read as a number");
    }
}

/// What all statements share: the values that are bound, and columns out of their bytes.
class TypedStatement : public PreparedStatement {
  public:
    TypedStatement(PostgresLink& link, std::vector<Oid> parameterTypes)
        : link_(link), types_(std::move(parameterTypes)), values_(types_.size()) {}

    void bindInteger(int position, std::int64_t value) override {
        const auto bits = static_cast<std::uint64_t>(value);
        switch (typeOf(position)) {
            case kInt8: return keep(position, bigEndian(bits, 8));
            case kInt4: return keep(position, bigEndian(bits, 4));
            case kInt2: return keep(position, bigEndian(bits, 2));
            case kBool: return keep(position, std::string(1, value != 0 ? '\1' : '\0'));
            case kFloat8: return bindReal(position, static_cast<double>(value));
            default: raise(ErrorCode::kInternal, "a number is bound to a parameter of another type");
        }
    }
    void bindReal(int position, double value) override {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof bits);
        keep(position, bigEndian(bits, sizeof bits));
    }
    void bindText(int position, const std::string& value) override { keep(position, value); }
    void bindBlob(int position, BlobView value) override {
        Value& slot = at(position);
        slot = {};
        // A null pointer would be NULL instead of an empty blob.
        slot.view = {value.data != nullptr ? value.data : "", value.size};
        slot.isBound = true;
    }
    void bindNull(int position) override { at(position) = {}; }

    std::int64_t integer(int column) const override {
        return isNull(column) ? 0 : integerOf(typeOfColumn(column), blob(column));
    }
    double real(int column) const override {
        if (isNull(column)) return 0;
        if (typeOfColumn(column) != kFloat8) return static_cast<double>(integer(column));
        return realOf(fromBigEndian(static_cast<const char*>(blob(column).data), 8));
    }
    std::string text(int column) const override {
        switch (typeOfColumn(column)) {
            case kInt8:
            case kInt4:
            case kInt2: return isNull(column) ? std::string() : std::to_string(integer(column));
            default: return bytesOf(blob(column));
        }
    }

  protected:
    struct Value {
        std::string kept;
        std::optional<BlobView> view;  ///< not owned, in place of `kept`
        bool isBound = false;          ///< false: NULL
        BlobView bytes() const { return view.value_or(viewOf(kept)); }
    };

    virtual Oid typeOfColumn(int column) const = 0;

    Oid typeOf(int position) {
        static_cast<void>(at(position));
        return types_[static_cast<std::size_t>(position - 1)];
    }
    const std::vector<Value>& values() const { return values_; }
    void forgetValues() noexcept {
        for (Value& value : values_) value = {};
    }

    PostgresLink& link_;

  private:
    Value& at(int position) {
        if (position < 1 || static_cast<std::size_t>(position) > values_.size()) {
            raise(ErrorCode::kInternal, "the statement has no parameter " + std::to_string(position));
        }
        return values_[static_cast<std::size_t>(position - 1)];
    }
    void keep(int position, std::string bytes) {
        Value& slot = at(position);
        slot = {};
        slot.kept = std::move(bytes);
        slot.isBound = true;
    }

    std::vector<Oid> types_;
    std::vector<Value> values_;
};

// Rows in results of libpq, at most kRowsAtATime where there may be many.
class CachedStatement final : public TypedStatement {
  public:
    CachedStatement(PostgresLink& link, std::string name, bool isCursor, std::vector<Oid> parameterTypes)
        : TypedStatement(link, std::move(parameterTypes)),
          name_(std::move(name)),
          isCursor_(isCursor),
          fetch_("FETCH " + std::to_string(kRowsAtATime) + " FROM c" + name_) {}

    bool step() override {
        if (!isRunning_) {
            start();
        } else {
            ++row_;
        }
        if (row_ < rowCount()) return true;
        if (!isCursor_ || rowCount() < kRowsAtATime) return false;
        fetch();
        return row_ < rowCount();
    }

    bool isNull(int column) const override { return PQgetisnull(rows_.get(), row_, column) != 0; }
    BlobView blob(int column) const override {
        if (isNull(column)) return {};
        return {PQgetvalue(rows_.get(), row_, column),
                static_cast<std::size_t>(PQgetlength(rows_.get(), row_, column))};
    }

    void reset() noexcept override {
        rows_.reset();
        forgetValues();
        // The cursor of a transaction that failed is gone with it.
        if (isRunning_ && isCursor_ && link_.isInTransaction()) {
            static_cast<void>(guarded("close a cursor", [&] { link_.query("CLOSE c" + name_); }));
        }
        isRunning_ = false;
    }

  private:
    Oid typeOfColumn(int column) const override { return PQftype(rows_.get(), column); }
    int rowCount() const { return rows_ == nullptr ? 0 : PQntuples(rows_.get()); }

    void start() {
        std::vector<BlobView> parameters;
        for (const Value& value : values()) {
            parameters.push_back(value.isBound ? value.bytes() : BlobView());
        }
        rows_ = link_.execute(name_, parameters);
        row_ = 0;
        isRunning_ = true;
        if (isCursor_) fetch();
    }

    void fetch() {
        rows_ = link_.rows(fetch_);
        row_ = 0;
    }

    std::string name_;
    bool isCursor_;
    std::string fetch_;
    PostgresResult rows_;
    int row_ = 0;
    bool isRunning_ = false;
};

// COPY takes no parameters: numbers and texts are written into the statement.
class CopyStatement final : public TypedStatement {
  public:
    CopyStatement(PostgresLink& link, std::string text, std::vector<Oid> parameterTypes,
                  std::vector<Oid> columnTypes)
        : TypedStatement(link, std::move(parameterTypes)),
          text_(std::move(text)),
          columnTypes_(std::move(columnTypes)),
          fields_(columnTypes_.size()) {}

    bool step() override {
        if (!isRunning_) start();
        BlobView row;
        if (!link_.nextOfCopy(row)) return false;
        const auto* data = static_cast<const char*>(row.data);
        Reader reader{data, data + row.size};
        if (isFirst_) {
            static_cast<void>(reader.take(kCopyHeader - 4));
            static_cast<void>(reader.take(reader.number(4)));
            isFirst_ = false;
        }
        return read(reader);
    }

    bool isNull(int column) const override { return blob(column).data == nullptr; }
    BlobView blob(int column) const override { return fields_[static_cast<std::size_t>(column)]; }

    void reset() noexcept override {
        forgetValues();
        if (isRunning_ && !link_.isBroken()) {
            static_cast<void>(guarded("end a copy", [&] { link_.endCopy(); }));
        }
        isRunning_ = false;
    }

  private:
    /// Of the bytes of one row.
    struct Reader {
        const char* at;
        const char* end;
        const char* take(std::size_t bytes) {
            if (static_cast<std::size_t>(end - at) < bytes) {
                raise(ErrorCode::kInternal, "the database has sent a row that ends too soon");
            }
            return std::exchange(at, at + bytes);
        }
        std::size_t number(std::size_t bytes) {
            return static_cast<std::size_t>(fromBigEndian(take(bytes), bytes));
        }
    };

    Oid typeOfColumn(int column) const override { return columnTypes_[static_cast<std::size_t>(column)]; }

    void start() {
        std::string sql;
        for (std::size_t at = 0; at < text_.size(); ++at) {
            if (text_[at] != '?') {
                sql += text_[at];
            } else {
                sql += literal(text_[++at] - '0');
            }
        }
        link_.startCopy(sql);
        isRunning_ = true;
        isFirst_ = true;
    }

    /// The value of the next parameter, as SQL.
    std::string literal(int position) {
        const Value& value = values()[static_cast<std::size_t>(position - 1)];
        if (!value.isBound) return "NULL";
        switch (const Oid type = typeOf(position)) {
            case kInt8:
            case kInt4:
            case kInt2: return "(" + std::to_string(integerOf(type, value.bytes())) + ")";
            case kText: return sqlLiteral(bytesOf(value.bytes()));
            default: raise(ErrorCode::kInternal, "a copy cannot be given a value of this type");
        }
    }

    /// False: the row is the end of the copy.
    bool read(Reader& reader) {
        const std::size_t count = reader.number(2);
        if (count == kEndOfCopy) {
            BlobView none;
            if (link_.nextOfCopy(none)) raise(ErrorCode::kInternal, "the database sends rows after the last");
            return false;
        }
        if (count != fields_.size())
            raise(ErrorCode::kInternal, "the database has sent a row of other columns");
        for (BlobView& field : fields_) {
            const std::size_t size = reader.number(4);
            field = size == kNull ? BlobView{} : BlobView{reader.take(size), size};
        }
        return true;
    }

    std::string text_;
    std::vector<Oid> columnTypes_;
    std::vector<BlobView> fields_;
    bool isRunning_ = false;
    bool isFirst_ = false;
};

}  // namespace

std::string sqlLiteral(const std::string& text) {
    std::string literal = "'";
    for (const char c : text) {
        if (c == '\'') literal += c;
        literal += c;
    }
    return literal + "'";
}

std::unique_ptr<PreparedStatement> preparedStatement(PostgresLink& link, const std::string& name,
                                                     const std::string& text) {
    const bool isCopy = text.rfind(kCopy, 0) == 0;
    const bool isCursor = mayFindMany(text);
    // Of a copy, to learn its types.
    std::string prepared =
        isCopy ? text.substr(sizeof kCopy - 1, text.rfind(kToStdout) - (sizeof kCopy - 1)) : text;
    if (isCursor) prepared.insert(0, "DECLARE c" + name + " NO SCROLL CURSOR FOR ");
    link.prepare(name, withDollars(std::move(prepared)));
    const PostgresResult described = link.describe(name);
    std::vector<Oid> parameters;
    for (int i = 0; i < PQnparams(described.get()); ++i)
        parameters.push_back(PQparamtype(described.get(), i));
    if (!isCopy) return std::make_unique<CachedStatement>(link, name, isCursor, std::move(parameters));
    std::vector<Oid> columns;
    for (int i = 0; i < PQnfields(described.get()); ++i) columns.push_back(PQftype(described.get(), i));
    return std::make_unique<CopyStatement>(link, text, std::move(parameters), std::move(columns));
}

}  // namespace shapedb::store
