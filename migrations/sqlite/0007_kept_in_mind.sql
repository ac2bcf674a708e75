-- collection.waiting: pending shapes without a signature that serves, so that each search can tell their number. Kept by
-- the triggers below, also when a rebuild changes which signatures serve.
-- deleted_shape: the last shapes that were deleted with an expected version, as they were, so that the call can be
-- repeated when its reply was lost. `metadata` is a JSON object.
-- notice: what an operator has to acknowledge.

ALTER TABLE collection ADD COLUMN waiting INTEGER NOT NULL DEFAULT 0;

UPDATE collection SET waiting =
    (SELECT count(*) FROM shape s WHERE s.collection_id = collection.id AND s.state = 0 AND NOT EXISTS
        (SELECT 1 FROM signature g WHERE g.shape_id = s.id AND g.generation = collection.generation));

CREATE TRIGGER shape_added AFTER INSERT ON shape WHEN NEW.state = 0 BEGIN
    UPDATE collection SET waiting = waiting + 1 WHERE id = NEW.collection_id;
END;

CREATE TRIGGER shape_changed AFTER UPDATE OF state ON shape WHEN (OLD.state = 0) <> (NEW.state = 0) BEGIN
    UPDATE collection SET waiting = waiting + iif(NEW.state = 0, 1, -1) WHERE id = NEW.collection_id AND NOT EXISTS
        (SELECT 1 FROM signature g WHERE g.shape_id = NEW.id AND g.generation = collection.generation);
END;

-- Before: its signatures go with it.
CREATE TRIGGER shape_removed BEFORE DELETE ON shape WHEN OLD.state = 0 BEGIN
    UPDATE collection SET waiting = waiting - 1 WHERE id = OLD.collection_id AND NOT EXISTS
        (SELECT 1 FROM signature g WHERE g.shape_id = OLD.id AND g.generation = collection.generation);
END;

CREATE TRIGGER signature_added AFTER INSERT ON signature BEGIN
    UPDATE collection SET waiting = waiting - 1 WHERE generation = NEW.generation AND
        id = (SELECT collection_id FROM shape WHERE id = NEW.shape_id AND state = 0);
END;

CREATE TRIGGER signature_removed AFTER DELETE ON signature BEGIN
    UPDATE collection SET waiting = waiting + 1 WHERE generation = OLD.generation AND
        id = (SELECT collection_id FROM shape WHERE id = OLD.shape_id AND state = 0);
END;

CREATE TRIGGER generation_changed AFTER UPDATE OF generation ON collection BEGIN
    UPDATE collection SET waiting =
        (SELECT count(*) FROM shape s WHERE s.collection_id = NEW.id AND s.state = 0 AND NOT EXISTS
            (SELECT 1 FROM signature g WHERE g.shape_id = s.id AND g.generation = NEW.generation))
        WHERE id = NEW.id;
END;

CREATE TABLE deleted_shape (
    id              INTEGER PRIMARY KEY,
    collection_id   INTEGER NOT NULL REFERENCES collection (id) ON DELETE CASCADE,
    key             TEXT    NOT NULL,
    shape_id        INTEGER NOT NULL,
    version         INTEGER NOT NULL,
    points_version  INTEGER NOT NULL,
    state           INTEGER NOT NULL CHECK (state IN (0, 1, 2)),
    point_count     INTEGER NOT NULL,
    checksum        BLOB    NOT NULL CHECK (length(checksum) = 32),
    created_at      INTEGER NOT NULL,
    updated_at      INTEGER NOT NULL,
    failure_code    TEXT,
    failure_message TEXT,
    origin_x        REAL    NOT NULL,
    origin_y        REAL    NOT NULL,
    origin_z        REAL    NOT NULL,
    metadata        TEXT    NOT NULL
) STRICT;

CREATE INDEX deleted_shape_by_key ON deleted_shape (collection_id, key);

CREATE TABLE notice (
    id         INTEGER PRIMARY KEY,
    noticed_at INTEGER NOT NULL,
    missing    INTEGER NOT NULL CHECK (missing >= 0),  -- acknowledged changes
    message    TEXT    NOT NULL
) STRICT;
