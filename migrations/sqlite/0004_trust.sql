-- job.stops: how often the process ended while the scan was being segmented without the scan being to blame (a kill, a
-- power failure). Such jobs run after all others.
-- tally.commits: transactions that changed something, to notice at start that some of them are gone.

ALTER TABLE job ADD COLUMN stops INTEGER NOT NULL DEFAULT 0;
DROP INDEX job_by_state;
CREATE INDEX job_by_state ON job (state, stops);

ALTER TABLE tally ADD COLUMN commits INTEGER NOT NULL DEFAULT 0;
