-- The journal of a catalogue. Times are milliseconds since 1970, sizes bytes, paths the bytes of
-- the file system (name is the same as text, to be read by people).
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;

-- One row for each run of the batch.
CREATE TABLE run (
    id            INTEGER PRIMARY KEY,
    version       TEXT NOT NULL,
    command       TEXT NOT NULL,
    started_ms    INTEGER NOT NULL,
    ended_ms      INTEGER,
    ending        TEXT,               -- done, stopped, interrupted, disk_full; NULL: killed or under way
    found         INTEGER NOT NULL DEFAULT 0,
    passed_by     TEXT NOT NULL DEFAULT '{}'
);

-- One row for each model that was ever seen.
CREATE TABLE model (
    id                INTEGER PRIMARY KEY,
    path              BLOB NOT NULL UNIQUE,
    name              TEXT NOT NULL,
    output            BLOB NOT NULL,
    result            BLOB,               -- where the result lies, if that is not output
    format            TEXT NOT NULL,
    run_id            INTEGER NOT NULL,   -- the last run that saw it
    -- pending, copied, repaired, degraded, failed, gone
    state             TEXT NOT NULL,
    -- of a repaired one: pass, review
    verdict           TEXT,
    -- of a failed one: input, model, usage, memory, timeout, crash, internal, disk, lock, temporary
    cause             TEXT,
    reason            TEXT,
    -- why it was asked for the last time
    because           TEXT,
    -- the input as it was when its result was made, and its settings
    input_bytes       INTEGER NOT NULL,
    input_mtime_ns    INTEGER NOT NULL,
    input_ctime_ns    INTEGER NOT NULL,
    input_inode       INTEGER NOT NULL,
    input_digest      BLOB,
    settings_digest   BLOB NOT NULL,
    -- what it will take
    predicted_seconds REAL,
    predicted_memory  INTEGER,
    predicted_disk    INTEGER,
    predicted_leaves  INTEGER,
    -- what it took
    ended_ms          INTEGER,
    seconds           REAL,
    cpu_seconds       REAL,
    peak_bytes        INTEGER,
    -- what came of it
    depth             INTEGER,
    triangles_before  INTEGER,
    triangles_after   INTEGER,
    open_edges_before INTEGER,
    duplicates_before INTEGER,
    openings_before   INTEGER,
    area_ratio        REAL,
    volume            REAL,
    outcome           TEXT
);
CREATE INDEX model_state ON model (state, cause);

-- The files of a result.
CREATE TABLE output_file (
    model_id  INTEGER NOT NULL REFERENCES model (id) ON DELETE CASCADE,
    path      BLOB NOT NULL,
    bytes     INTEGER NOT NULL,
    mtime_ns  INTEGER NOT NULL,
    ctime_ns  INTEGER NOT NULL,
    inode     INTEGER NOT NULL,
    digest    BLOB NOT NULL,
    PRIMARY KEY (model_id, path)
) WITHOUT ROWID;

CREATE INDEX output_file_path ON output_file (path);

-- The files that a model names, by their paths within the folder of the models: libraries, images,
-- buffers. Those that are not there have no digest.
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

-- Each time a worker was set to a model.
CREATE TABLE attempt (
    id           INTEGER PRIMARY KEY,
    model_id     INTEGER NOT NULL REFERENCES model (id) ON DELETE CASCADE,
    run_id       INTEGER NOT NULL REFERENCES run (id),
    rung         TEXT NOT NULL,       -- shared, alone, coarser
    memory_bytes INTEGER NOT NULL,
    threads      INTEGER NOT NULL,
    started_ms   INTEGER NOT NULL,
    ended_ms     INTEGER,             -- NULL: under way, or the batch was killed
    ending       TEXT,                -- as model.state and model.cause; or stopped
    message      TEXT
);
CREATE INDEX attempt_model ON attempt (model_id);

CREATE VIEW failures AS
    SELECT name, cause, reason, seconds,
           (SELECT count(*) FROM attempt WHERE attempt.model_id = model.id) AS attempts
    FROM model WHERE state = 'failed' ORDER BY cause, name;
CREATE VIEW reviews AS
    SELECT name, reason FROM model WHERE verdict = 'review' ORDER BY name;
CREATE VIEW slowest AS
    SELECT name, seconds, predicted_seconds, depth, triangles_before FROM model
    WHERE seconds IS NOT NULL ORDER BY seconds DESC;
CREATE VIEW largest AS
    SELECT name, input_bytes, triangles_before, peak_bytes FROM model ORDER BY input_bytes DESC;
CREATE VIEW states AS
    SELECT state, verdict, cause, count(*) AS models, sum(seconds) AS seconds FROM model
    GROUP BY state, verdict, cause ORDER BY models DESC;
CREATE VIEW under_way AS
    SELECT model.name, attempt.rung, attempt.started_ms, attempt.memory_bytes FROM attempt
    JOIN model ON model.id = attempt.model_id
    JOIN run ON run.id = attempt.run_id
    WHERE attempt.ended_ms IS NULL AND run.id = (SELECT max(id) FROM run) AND run.ending IS NULL;
