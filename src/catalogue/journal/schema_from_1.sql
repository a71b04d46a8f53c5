-- From schema 1, which did not know the files that models name: models whose formats can name some
-- are done once more.
ALTER TABLE model ADD COLUMN result BLOB;
ALTER TABLE model ADD COLUMN because TEXT;
CREATE INDEX output_file_path ON output_file (path);
CREATE TABLE side_file (
    path      BLOB NOT NULL,
    model_id  INTEGER NOT NULL REFERENCES model (id) ON DELETE CASCADE,
    bytes     INTEGER,
    mtime_ns  INTEGER,
    ctime_ns  INTEGER,
    inode     INTEGER,
    digest    BLOB,
    PRIMARY KEY (path, model_id)
) WITHOUT ROWID;
CREATE INDEX side_file_model ON side_file (model_id);
UPDATE model SET state = 'pending', verdict = NULL, cause = NULL, reason = NULL,
    because = 'the journal did not know yet which files it names'
WHERE state NOT IN ('pending', 'gone') AND NOT (lower(name) GLOB '*.stl*'
    OR lower(name) GLOB '*.off*' OR lower(name) GLOB '*.3mf*');
UPDATE meta SET value = '2' WHERE key = 'schema';
