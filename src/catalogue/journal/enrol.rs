//! Enters what a walk found, and tells what has to be done with it.

use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

use rusqlite::{Connection, Row, params};

use crate::catalogue::CatalogueError;
use crate::catalogue::journal::{Journal, failed};
use crate::catalogue::names::distinct_name;
use crate::catalogue::stamp::Stamp;
use crate::catalogue::state::{Cause, State};
use crate::io::Format;
use crate::store::Digest;

/// A model as a walk found it, with what is wanted of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Path within the folder of the models.
    pub relative: PathBuf,
    /// What the file system says of it.
    pub stamp: Stamp,
    /// The name that its result should have.
    pub wish: PathBuf,
    /// Format of the result.
    pub format: Format,
    /// Digest of all that changes the result.
    pub settings: Digest,
}

/// What there is to look at closer after a walk.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Enrolled {
    /// Settled models whose file is not what it was: by number.
    pub touched: Vec<i64>,
    /// Results that are told apart by the extension of their models.
    pub told_apart: u64,
    /// Models whose result would be that of another.
    pub clashes: u64,
    /// Models that are gone since the last run.
    pub gone: u64,
    /// Files of results that have other names now, as they were put in place.
    pub renamed: Vec<(PathBuf, Stamp)>,
}

const SEEN: &str = "
    CREATE TEMP TABLE IF NOT EXISTS seen (
        path BLOB PRIMARY KEY, name TEXT, wish BLOB, format TEXT, settings BLOB,
        bytes INTEGER, mtime_ns INTEGER, ctime_ns INTEGER, inode INTEGER
    ) WITHOUT ROWID;
    DELETE FROM temp.seen;";

const DOUBLES: &str = "
    SELECT path, format FROM temp.seen
    WHERE wish IN (SELECT wish FROM temp.seen GROUP BY wish HAVING count(*) > 1)";

const NEW: &str = "
    INSERT INTO model (path, name, output, format, run_id, state, because, settings_digest,
                       input_bytes, input_mtime_ns, input_ctime_ns, input_inode)
    SELECT path, name, wish, format, ?1, 'pending', 'it is new', settings, bytes, mtime_ns, ctime_ns,
           inode FROM temp.seen WHERE true
    ON CONFLICT (path) DO UPDATE SET run_id = excluded.run_id";

/// Other settings, another place, or back again: what was made counts no longer.
const ASKED_ANEW: &str = "
    UPDATE model SET state = 'pending', verdict = NULL, cause = NULL, reason = NULL,
        because = CASE WHEN model.state = 'gone' THEN 'it is there again'
            WHEN model.settings_digest <> seen.settings
            THEN 'other settings, or another version of the program'
            ELSE 'its result has another name or format' END,
        settings_digest = seen.settings, output = seen.wish, format = seen.format,
        predicted_seconds = NULL
    FROM temp.seen AS seen WHERE seen.path = model.path
      AND (model.settings_digest <> seen.settings OR model.output <> seen.wish
           OR model.format <> seen.format OR model.state = 'gone')";

const RENAMED: &str = "
    SELECT output_file.path, output_file.bytes, output_file.mtime_ns, output_file.ctime_ns,
           output_file.inode
    FROM output_file JOIN model ON model.id = output_file.model_id
    JOIN temp.seen AS seen ON seen.path = model.path WHERE model.output <> seen.wish
    ORDER BY output_file.path";

const FORGET_RENAMED: &str = "
    DELETE FROM output_file WHERE model_id IN
    (SELECT model.id FROM model JOIN temp.seen AS seen ON seen.path = model.path
     WHERE model.output <> seen.wish)";

/// Why a model is refused whose result has the name of another's.
const CLASH: &str = "another model's result has the same name; rename one of them";

/// Names may no longer clash.
const FORGET_CLASHES: &str = "UPDATE model SET state = 'pending', cause = NULL, reason = NULL
    WHERE state = 'failed' AND reason = ?1";

/// Nothing rests on what these were.
const PENDING_STAMPS: &str = "
    UPDATE model SET input_bytes = seen.bytes, input_mtime_ns = seen.mtime_ns,
        input_ctime_ns = seen.ctime_ns, input_inode = seen.inode, predicted_seconds = NULL
    FROM temp.seen AS seen WHERE seen.path = model.path AND model.state = 'pending'
      AND (model.input_bytes <> seen.bytes OR model.input_mtime_ns <> seen.mtime_ns
           OR model.input_ctime_ns <> seen.ctime_ns OR model.input_inode <> seen.inode)";

const TOUCHED: &str = "
    SELECT model.id FROM model JOIN temp.seen AS seen USING (path) WHERE model.state <> 'pending'
      AND (model.input_bytes <> seen.bytes OR model.input_mtime_ns <> seen.mtime_ns
           OR model.input_ctime_ns <> seen.ctime_ns OR model.input_inode <> seen.inode)
    ORDER BY model.id";

const UNSEEN: &str = "SELECT id, path FROM model WHERE run_id <> ?1 AND state <> 'gone'";

/// A path from its column.
pub(super) fn path_of(row: &Row, column: usize) -> rusqlite::Result<PathBuf> {
    Ok(OsString::from_vec(row.get(column)?).into())
}

/// A stamp from four columns.
pub(super) fn stamp_of(row: &Row, first: usize) -> rusqlite::Result<Stamp> {
    Ok(Stamp {
        bytes: row.get::<_, i64>(first)? as u64,
        mtime_ns: row.get(first + 1)?,
        ctime_ns: row.get(first + 2)?,
        inode: row.get::<_, i64>(first + 3)? as u64,
    })
}

/// Bytes of a path, for its column.
pub(super) fn bytes_of(path: &Path) -> &[u8] {
    path.as_os_str().as_bytes()
}

impl Journal {
    /// Enters the models that `walk` shows, as one transaction, for the run with number `run`.
    /// `source` is their folder.
    ///
    /// # Errors
    /// The journal cannot be written, or what `walk` says.
    pub fn enrol<T>(
        &mut self,
        run: i64,
        source: &Path,
        walk: impl FnOnce(
            &mut dyn FnMut(Seen) -> Result<(), CatalogueError>,
        ) -> Result<T, CatalogueError>,
    ) -> Result<(Enrolled, T), CatalogueError> {
        let path = self.path.clone();
        let fail = |error| failed(&path, error);
        self.connection.execute_batch(SEEN).map_err(fail)?;
        let transaction = self.connection.transaction().map_err(fail)?;
        let walked = {
            let insert = "INSERT OR REPLACE INTO temp.seen VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9)";
            let mut insert = transaction.prepare(insert).map_err(fail)?;
            walk(&mut |seen: Seen| {
                let stamp = seen.stamp;
                let entered = insert.execute(params![
                    bytes_of(&seen.relative),
                    seen.relative.to_string_lossy(),
                    bytes_of(&seen.wish),
                    seen.format.extension(),
                    seen.settings,
                    stamp.bytes as i64,
                    stamp.mtime_ns,
                    stamp.ctime_ns,
                    stamp.inode as i64,
                ]);
                entered.map(|_| ()).map_err(fail)
            })?
        };
        let enrolled = settle(&transaction, run, source).map_err(fail)?;
        transaction.commit().map_err(fail)?;
        Ok((enrolled, walked))
    }
}

fn settle(connection: &Connection, run: i64, source: &Path) -> rusqlite::Result<Enrolled> {
    let told_apart = tell_apart(connection)?;
    connection.execute(NEW, [run])?;
    let renamed = connection
        .prepare(RENAMED)?
        .query_map((), |row| Ok((path_of(row, 0)?, stamp_of(row, 1)?)))?
        .collect::<rusqlite::Result<_>>()?;
    connection.execute(FORGET_RENAMED, ())?;
    connection.execute(FORGET_CLASHES, [CLASH])?;
    connection.execute(ASKED_ANEW, ())?;
    connection.execute(PENDING_STAMPS, ())?;
    let clashes = refuse_clashes(connection)?;
    let touched = connection
        .prepare(TOUCHED)?
        .query_map((), |row| row.get(0))?
        .collect::<rusqlite::Result<_>>()?;
    let gone = find_gone(connection, run, source)?;
    Ok(Enrolled { touched, told_apart, clashes, gone, renamed })
}

/// Gives results of one name other names.
fn tell_apart(connection: &Connection) -> rusqlite::Result<u64> {
    let doubles: Vec<(PathBuf, Option<Format>)> = connection
        .prepare(DOUBLES)?
        .query_map((), |row| Ok((path_of(row, 0)?, format_of(&row.get::<_, String>(1)?))))?
        .collect::<rusqlite::Result<_>>()?;
    let mut update = connection.prepare("UPDATE temp.seen SET wish = ?2 WHERE path = ?1")?;
    for (path, format) in &doubles {
        let Some(format) = *format else { continue };
        let name = distinct_name(path, format);
        update.execute(params![bytes_of(path), bytes_of(&name)])?;
    }
    Ok(doubles.len() as u64)
}

/// What clashes even so is refused, all of it: no order of names decides whose result it is.
fn refuse_clashes(connection: &Connection) -> rusqlite::Result<u64> {
    let refuse = "
        UPDATE model SET state = ?1, cause = ?2, reason = ?3 WHERE path IN
        (SELECT path FROM temp.seen WHERE wish IN
         (SELECT wish FROM temp.seen GROUP BY wish HAVING count(*) > 1))";
    let words = params![State::Failed.name(), Cause::Usage.name(), CLASH];
    Ok(connection.execute(refuse, words)? as u64)
}

/// Marks the models that are no longer there; others were not asked for this time.
fn find_gone(connection: &Connection, run: i64, source: &Path) -> rusqlite::Result<u64> {
    let unseen: Vec<(i64, PathBuf)> = connection
        .prepare(UNSEEN)?
        .query_map([run], |row| Ok((row.get(0)?, path_of(row, 1)?)))?
        .collect::<rusqlite::Result<_>>()?;
    let mut update = connection.prepare("UPDATE model SET state = 'gone' WHERE id = ?1")?;
    let mut gone = 0;
    for (id, path) in unseen {
        if !source.join(path).exists() {
            gone += update.execute([id])? as u64;
        }
    }
    Ok(gone)
}

/// The format that an extension stands for.
pub(super) fn format_of(extension: &str) -> Option<Format> {
    crate::io::format_of_extension(&Path::new("x").with_extension(extension))
}
