-- API keys. In a file of their own beside the database: a backup holds no keys, and restoring an old one revives none.
-- Times are milliseconds since 1970 (UTC).
CREATE TABLE api_key (
    id               TEXT PRIMARY KEY,           -- 16 hexadecimal digits; not a secret
    name             TEXT NOT NULL,              -- for people; several keys may share it
    role             INTEGER NOT NULL CHECK (role IN (0, 1, 2)),  -- security::Role
    secret_sha256    BLOB NOT NULL CHECK (length(secret_sha256) = 32),
    collections      TEXT NOT NULL,              -- names, one per line; empty: all
    calls_per_second INTEGER NOT NULL,           -- this and the next two: 0 for no limit
    scans_per_day    INTEGER NOT NULL,
    bytes_per_day    INTEGER NOT NULL,
    created_at       INTEGER NOT NULL,
    expires_at       INTEGER,                    -- NULL: never
    revoked_at       INTEGER                     -- NULL: it was not
) STRICT;

-- What a key has used on a day (days since 1970, UTC). Rows of earlier days are deleted.
CREATE TABLE api_key_usage (
    key_id TEXT PRIMARY KEY REFERENCES api_key (id),
    day    INTEGER NOT NULL,
    scans  INTEGER NOT NULL,
    bytes  INTEGER NOT NULL
) STRICT;
