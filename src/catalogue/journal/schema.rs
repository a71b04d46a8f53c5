//! The version of the journal's tables: begun anew, taken over from an older one, or refused.

use rusqlite::{Connection, OptionalExtension};

/// Version of the tables.
pub(super) const SCHEMA: &str = "2";
/// The older versions, with what makes the next one of each.
const OLDER: [(&str, &str); 1] = [("1", include_str!("schema_from_1.sql"))];

/// The version of the tables that are there; none where there are no tables.
pub(super) fn found(connection: &Connection) -> rusqlite::Result<Option<String>> {
    let tables = "SELECT count(*) FROM sqlite_master WHERE name = 'meta'";
    let begun: i64 = connection.query_row(tables, (), |row| row.get(0))?;
    if begun == 0 {
        return Ok(None);
    }
    let asked = "SELECT value FROM meta WHERE key = 'schema'";
    let version: Option<String> = connection.query_row(asked, (), |row| row.get(0)).optional()?;
    Ok(Some(version.unwrap_or_default()))
}

/// Makes the tables, or takes over those of an older version.
pub(super) fn prepare(connection: &mut Connection) -> rusqlite::Result<()> {
    let Some(mut version) = found(connection)? else {
        let transaction = connection.transaction()?;
        transaction.execute_batch(include_str!("schema.sql"))?;
        transaction.execute("INSERT INTO meta VALUES ('schema', ?1)", [SCHEMA])?;
        return transaction.commit();
    };
    while let Some((_, step)) = OLDER.iter().find(|(older, _)| *older == version) {
        let transaction = connection.transaction()?;
        transaction.execute_batch(step)?;
        transaction.commit()?;
        version = found(connection)?.unwrap_or_default();
    }
    Ok(())
}

/// Lets questions be put to a journal of an older version as it is: what it does not have is empty.
pub(super) fn look_as_it_is(connection: &Connection) -> rusqlite::Result<()> {
    match found(connection)? {
        Some(version) if version == "1" => connection.execute_batch(
            "CREATE TEMP VIEW model AS SELECT *, NULL AS result, NULL AS because FROM main.model;
             CREATE TEMP TABLE side_file (path BLOB, model_id INTEGER, digest BLOB);",
        ),
        _ => Ok(()),
    }
}

/// Whether the tables are of a version that can be looked at.
pub(super) fn is_known(version: &str) -> bool {
    version == SCHEMA || OLDER.iter().any(|(older, _)| *older == version)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use crate::catalogue::CatalogueError;
    use crate::catalogue::journal::{FOLDER, JOURNAL, Journal};

    /// The tables of version 1, and three models.
    const FIRST: &str = include_str!("../../../testdata/journals/schema_1.sql");
    const MODELS: &str = "
        INSERT INTO meta VALUES ('schema', '1');
        INSERT INTO run (id, version, command, started_ms) VALUES (1, '0', '', 0);
        INSERT INTO model (id, path, name, output, format, run_id, state, input_bytes,
            input_mtime_ns, input_ctime_ns, input_inode, settings_digest)
        SELECT column1, CAST(column2 AS BLOB), column2, CAST(column2 AS BLOB), 'obj', 1, column3,
            0, 0, 0, 0, x'00' FROM (VALUES (1, 'a.obj', 'repaired'), (2, 'b.STL', 'repaired'),
            (3, 'c.obj', 'gone'));";

    fn begin_old(path: &Path) {
        let old = Connection::open(path).expect("a file");
        old.execute_batch(FIRST).expect("tables");
        old.execute_batch(MODELS).expect("rows");
    }

    /// Tables, indices and views with their columns.
    fn things(connection: &Connection) -> Vec<String> {
        let asked = "SELECT thing.name || ' ' || coalesce(field.name || ' ' || field.type, '')
            FROM sqlite_master AS thing LEFT JOIN pragma_table_info(thing.name) AS field
            ORDER BY 1";
        let mut asked = connection.prepare(asked).expect("a table");
        let rows = asked.query_map((), |row| row.get(0)).expect("readable");
        rows.collect::<Result<_, _>>().expect("readable")
    }

    #[test]
    fn an_older_journal_is_taken_over() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("old");
        begin_old(&path);
        let mut old = Connection::open(&path).expect("a file");
        prepare(&mut old).expect("taken over");
        assert_eq!(found(&old).expect("readable").as_deref(), Some(SCHEMA));
        let mut new = Connection::open_in_memory().expect("memory");
        prepare(&mut new).expect("begun");
        assert_eq!(things(&old), things(&new));
        let states = "SELECT group_concat(state, ' ') FROM (SELECT state FROM model ORDER BY id)";
        let states: String = old.query_row(states, (), |row| row.get(0)).expect("readable");
        assert_eq!(states, "pending repaired gone", "only what may name files is done once more");
    }

    #[test]
    fn an_older_journal_can_be_looked_at_and_stays_as_it_is() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir(folder.path().join(FOLDER)).expect("a folder");
        let path = folder.path().join(FOLDER).join(JOURNAL);
        begin_old(&path);
        let mut journal = Journal::open_to_read(folder.path()).expect("it is known");
        assert_eq!(journal.summary().expect("readable").states.len(), 2);
        let told = journal.tell(1).expect("readable");
        assert_eq!((told.output.as_str(), told.because), ("a.obj", None));
        assert_eq!(journal.totals().expect("readable").models, 3);
        drop(journal);
        let old = Connection::open(&path).expect("a file");
        assert_eq!(found(&old).expect("readable").as_deref(), Some("1"));
        old.execute("UPDATE meta SET value = '99' WHERE key = 'schema'", ()).expect("writable");
        drop(old);
        let refused = Journal::open_to_read(folder.path()).map(drop);
        assert!(matches!(refused, Err(CatalogueError::OtherSchema { found, .. }) if found == "99"));
    }
}
