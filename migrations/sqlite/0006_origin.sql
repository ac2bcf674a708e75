-- shape.origin_*: what the points are relative to, as it was sent with them. Positions in signatures and surface points
-- have it added.
--
-- Clients of earlier versions subtracted an offset themselves and kept it in the metadata, "x y z" under shapedb.offset,
-- and signatures were relative to it. It becomes the origin, and those shapes are segmented again; until then their old
-- signatures serve. What a running rebuild made of them is worthless.

ALTER TABLE shape ADD COLUMN origin_x REAL NOT NULL DEFAULT 0.0 CHECK (abs(origin_x) <= 3.4e38);
ALTER TABLE shape ADD COLUMN origin_y REAL NOT NULL DEFAULT 0.0 CHECK (abs(origin_y) <= 3.4e38);
ALTER TABLE shape ADD COLUMN origin_z REAL NOT NULL DEFAULT 0.0 CHECK (abs(origin_z) <= 3.4e38);

-- Only what is three numbers within those limits: metadata are the clients'.
CREATE TEMP TABLE moved AS
    SELECT shape_id, x, y, z
    FROM (
        SELECT shape_id, CAST(json_extract(list, '$[0]') AS REAL) AS x, CAST(json_extract(list, '$[1]') AS REAL) AS y,
               CAST(json_extract(list, '$[2]') AS REAL) AS z
        FROM (
            SELECT shape_id, CASE WHEN json_valid('[' || replace(value, ' ', ',') || ']')
                                  THEN '[' || replace(value, ' ', ',') || ']' ELSE '[]' END AS list
            FROM shape_metadata WHERE name = 'shapedb.offset'
        )
        WHERE json_array_length(list) = 3
          AND (SELECT count(*) FROM json_each(list) WHERE type IN ('integer', 'real')) = 3
    )
    WHERE max(abs(x), abs(y), abs(z)) <= 3.4e38;

UPDATE shape SET origin_x = m.x, origin_y = m.y, origin_z = m.z FROM moved m WHERE m.shape_id = shape.id;
DELETE FROM shape_metadata WHERE name = 'shapedb.offset' AND shape_id IN (SELECT shape_id FROM moved);

DELETE FROM rebuild_failure WHERE shape_id IN (SELECT shape_id FROM moved);
DELETE FROM signature WHERE shape_id IN (SELECT shape_id FROM moved) AND generation <>
    (SELECT c.generation FROM shape s JOIN collection c ON c.id = s.collection_id WHERE s.id = signature.shape_id);
INSERT INTO job (shape_id, points_version, state, attempts, point_bytes, queued_at)
    SELECT s.id, s.points_version, 0, 0, p.point_bytes, s.updated_at
    FROM moved m JOIN shape s ON s.id = m.shape_id JOIN shape_points p ON p.shape_id = s.id WHERE s.state = 1 ORDER BY s.id;
UPDATE shape SET state = 0 WHERE state = 1 AND id IN (SELECT shape_id FROM moved);
DROP TABLE moved;
