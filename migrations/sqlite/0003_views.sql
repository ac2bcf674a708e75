-- What a camera would see of a shape from twenty sides (docs/views.md), for queries of one side. NULL: none, because the
-- collection does without or the signature is older. `digest` is that of `bytes` followed by `views`.

ALTER TABLE signature ADD COLUMN views BLOB;
