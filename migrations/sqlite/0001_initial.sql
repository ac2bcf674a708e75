-- Collections, shapes with their points and signatures, the job queue and rebuilds.
-- The numbers of shape.state, job.state and rebuild.state are those of server/store/store.h.

CREATE TABLE collection (
    id          INTEGER PRIMARY KEY AUTOINCREMENT,
    name        TEXT    NOT NULL UNIQUE,
    description TEXT    NOT NULL,
    parameters  TEXT    NOT NULL,
    generation  INTEGER NOT NULL CHECK (generation >= 1),
    created_at  INTEGER NOT NULL
) STRICT;

CREATE TABLE shape (
    id              INTEGER PRIMARY KEY AUTOINCREMENT,
    collection_id   INTEGER NOT NULL REFERENCES collection (id) ON DELETE CASCADE,
    key             TEXT    NOT NULL,
    version         INTEGER NOT NULL CHECK (version >= 1),
    points_version  INTEGER NOT NULL CHECK (points_version BETWEEN 1 AND version),
    state           INTEGER NOT NULL CHECK (state IN (0, 1, 2)),
    point_count     INTEGER NOT NULL CHECK (point_count >= 0),
    checksum        BLOB    NOT NULL CHECK (length(checksum) = 32),
    created_at      INTEGER NOT NULL,
    updated_at      INTEGER NOT NULL,
    failure_code    TEXT,
    failure_message TEXT,
    UNIQUE (collection_id, key),
    CHECK ((state = 2) = (failure_code IS NOT NULL)),
    CHECK ((state = 2) = (failure_message IS NOT NULL))
) STRICT;

-- Every index ends with the rowid, which is shape.id: both give pages by rising id.
CREATE INDEX shape_by_collection ON shape (collection_id);
CREATE INDEX shape_by_state ON shape (collection_id, state);

CREATE TABLE shape_metadata (
    shape_id INTEGER NOT NULL REFERENCES shape (id) ON DELETE CASCADE,
    name     TEXT    NOT NULL,
    value    TEXT    NOT NULL,
    PRIMARY KEY (shape_id, name)
) STRICT, WITHOUT ROWID;

-- Apart from shape, so that listings do not page past the blobs.
CREATE TABLE shape_points (
    shape_id     INTEGER PRIMARY KEY REFERENCES shape (id) ON DELETE CASCADE,
    point_bytes  INTEGER NOT NULL CHECK (point_bytes >= 0),
    stored_bytes INTEGER NOT NULL CHECK (stored_bytes >= 1),
    points       BLOB    NOT NULL
) STRICT;

CREATE TABLE signature (
    shape_id       INTEGER NOT NULL REFERENCES shape (id) ON DELETE CASCADE,
    generation     INTEGER NOT NULL CHECK (generation >= 1),
    points_version INTEGER NOT NULL CHECK (points_version >= 1),
    digest         INTEGER NOT NULL,
    bytes          BLOB    NOT NULL,
    PRIMARY KEY (shape_id, generation)
) STRICT;

-- At most one job per shape: replacing the points replaces the job.
CREATE TABLE job (
    id             INTEGER PRIMARY KEY AUTOINCREMENT,
    shape_id       INTEGER NOT NULL UNIQUE REFERENCES shape (id) ON DELETE CASCADE,
    points_version INTEGER NOT NULL CHECK (points_version >= 1),
    state          INTEGER NOT NULL CHECK (state IN (0, 1)),
    attempts       INTEGER NOT NULL CHECK (attempts >= 0),
    point_bytes    INTEGER NOT NULL CHECK (point_bytes >= 0),
    queued_at      INTEGER NOT NULL
) STRICT;

CREATE INDEX job_by_state ON job (state);

CREATE TABLE rebuild (
    id                INTEGER PRIMARY KEY AUTOINCREMENT,
    collection_id     INTEGER NOT NULL REFERENCES collection (id) ON DELETE CASCADE,
    target_generation INTEGER NOT NULL CHECK (target_generation >= 2),
    parameters        TEXT    NOT NULL,
    state             INTEGER NOT NULL CHECK (state IN (0, 1, 2, 3)),
    done              INTEGER NOT NULL,
    failed            INTEGER NOT NULL,
    total             INTEGER NOT NULL,
    started_at        INTEGER NOT NULL,
    finished_at       INTEGER NOT NULL
) STRICT;

CREATE INDEX rebuild_by_collection ON rebuild (collection_id);
CREATE UNIQUE INDEX rebuild_running ON rebuild (collection_id) WHERE state = 0;

CREATE TABLE rebuild_failure (
    rebuild_id     INTEGER NOT NULL REFERENCES rebuild (id) ON DELETE CASCADE ON UPDATE CASCADE,
    shape_id       INTEGER NOT NULL REFERENCES shape (id) ON DELETE CASCADE,
    points_version INTEGER NOT NULL CHECK (points_version >= 1),
    code           TEXT    NOT NULL,
    message        TEXT    NOT NULL,
    PRIMARY KEY (rebuild_id, shape_id)
) STRICT, WITHOUT ROWID;

CREATE INDEX rebuild_failure_by_shape ON rebuild_failure (shape_id);

-- Sums kept by triggers, so that the bounds of the queue and the statistics cost one row.
CREATE TABLE tally (
    id                 INTEGER PRIMARY KEY CHECK (id = 1),
    jobs               INTEGER NOT NULL,
    job_bytes          INTEGER NOT NULL,
    point_bytes        INTEGER NOT NULL,
    stored_point_bytes INTEGER NOT NULL
) STRICT;

INSERT INTO tally VALUES (1, 0, 0, 0, 0);

CREATE TRIGGER job_added AFTER INSERT ON job BEGIN
    UPDATE tally SET jobs = jobs + 1, job_bytes = job_bytes + NEW.point_bytes;
END;

CREATE TRIGGER job_removed AFTER DELETE ON job BEGIN
    UPDATE tally SET jobs = jobs - 1, job_bytes = job_bytes - OLD.point_bytes;
END;

CREATE TRIGGER points_added AFTER INSERT ON shape_points BEGIN
    UPDATE tally SET point_bytes = point_bytes + NEW.point_bytes,
                     stored_point_bytes = stored_point_bytes + NEW.stored_bytes;
END;

CREATE TRIGGER points_removed AFTER DELETE ON shape_points BEGIN
    UPDATE tally SET point_bytes = point_bytes - OLD.point_bytes,
                     stored_point_bytes = stored_point_bytes - OLD.stored_bytes;
END;
