-- SPDX-License-Identifier: GPL-3.0-or-later
-- Shards: each shape is of one of 256, and servers hold shards under leases.

-- As cluster::shardOf (server/cluster/shard.h): splitmix64 of the id, its highest eight bits, by whole numbers that stay
-- below 2^63. A product modulo 2^64 is made of halves of 32 bits, the second factor of pieces of 16. Shifts and masks bind
-- equally, less than + and *.
CREATE FUNCTION shard_of(id bigint) RETURNS smallint LANGUAGE plpgsql IMMUTABLE STRICT PARALLEL SAFE AS $$
DECLARE
    -- + 0x9e3779b9 7f4a7c15
    low  bigint := (id & 4294967295) + 2135587861;
    high bigint := (id >> 32) + 2654435769 + (low >> 32);
    bits bigint := (high << 32) | (low & 4294967295);
BEGIN
    bits := bits # (bits >> 30 & 17179869183);
    low := bits & 4294967295;
    high := bits >> 32 & 4294967295;
    -- * 0xbf58476d 1ce4e5b9: first the lower halves with each other.
    bits := (low * 7396 + (low * 58809 >> 16) << 16) | (low * 58809 & 65535);
    high := (bits >> 32) + high * 58809 + (high * 7396 << 16) + low * 18285 + (low * 48984 & 65535 << 16);
    bits := (high << 32) | (bits & 4294967295);
    bits := bits # (bits >> 27 & 137438953471);
    low := bits & 4294967295;
    high := bits >> 32 & 4294967295;
    -- * 0x94d049bb 133111eb: only the upper half of the product. The last step of splitmix64 leaves its highest bits alone.
    high := (low * 4913 + (low * 4587 >> 16) >> 16) + high * 4587 + (high * 4913 << 16) + low * 18875
        + (low * 38096 & 65535 << 16);
    RETURN high >> 24 & 255;
END $$;

-- The table is written anew. No index has the shard: who reads some shards of a collection passes over the shapes of the
-- others in order of id, which costs less than the index would with each write.
ALTER TABLE shape ADD COLUMN shard smallint NOT NULL GENERATED ALWAYS AS (shard_of(id)) STORED;

-- The leases (server/cluster/lease_table.h). All times: ms since 1970-01-01 UTC by the clock of the database. Few narrow
-- rows that are changed at every beat of every server; who changes any of them holds one advisory lock.
CREATE TABLE cluster_server (
    name  text   COLLATE "C" PRIMARY KEY,
    until bigint NOT NULL  -- it counts as alive
) WITH (fillfactor = 25, autovacuum_vacuum_scale_factor = 0, autovacuum_vacuum_threshold = 1000,
        autovacuum_vacuum_cost_delay = 0);

CREATE TABLE cluster_slot (
    shard     smallint NOT NULL CHECK (shard BETWEEN 0 AND 255),
    slot      smallint NOT NULL CHECK (slot >= 0),
    epoch     bigint   NOT NULL CHECK (epoch >= 0),
    lease_end bigint   NOT NULL DEFAULT 0,
    holder    text     COLLATE "C" NOT NULL DEFAULT '',  -- empty: nobody
    wanted_by text     COLLATE "C" NOT NULL DEFAULT '',  -- the same
    PRIMARY KEY (shard, slot)
) WITH (fillfactor = 25, autovacuum_vacuum_scale_factor = 0, autovacuum_vacuum_threshold = 1000,
        autovacuum_vacuum_cost_delay = 0);
