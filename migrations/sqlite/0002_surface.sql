-- Surface points of a shape, to lay it on a query (docs/fit.md). Made from the points alone, so that one row serves
-- all generations; a pending shape keeps that of its older points as long as their signature serves.
-- Shapes from before this migration have none until they are rebuilt.

CREATE TABLE shape_surface (
    shape_id       INTEGER PRIMARY KEY REFERENCES shape (id) ON DELETE CASCADE,
    points_version INTEGER NOT NULL CHECK (points_version >= 1),
    digest         INTEGER NOT NULL,
    bytes          BLOB    NOT NULL
) STRICT;
