-- shape_by_change: listings by time of change.
-- collection_alias: other names of collections. No collection has one of these names.

CREATE INDEX shape_by_change ON shape (collection_id, updated_at);

CREATE TABLE collection_alias (
    name          TEXT    PRIMARY KEY,
    collection_id INTEGER NOT NULL REFERENCES collection (id) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE INDEX collection_alias_by_collection ON collection_alias (collection_id);
