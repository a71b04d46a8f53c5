//! The rows of files that models name.

use std::path::{Path, PathBuf};

use rusqlite::{Connection, Row, params};

use crate::catalogue::CatalogueError;
use crate::catalogue::beside::SideFile;
use crate::catalogue::journal::enrol::{bytes_of, path_of, stamp_of};
use crate::catalogue::journal::{Journal, ToldBeside};
use crate::catalogue::stamp::{Stamp, Stamped};

/// A file that a settled model names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SideRow {
    /// Number of the model.
    pub model: i64,
    /// Path within the folder of the models.
    pub path: PathBuf,
    /// The file as it was when the model was settled; `None` where it was not there.
    pub then: Option<Stamped>,
}

fn row_of(row: &Row) -> rusqlite::Result<SideRow> {
    let digest: Option<_> = row.get(6)?;
    let then = match digest {
        Some(digest) => Some(Stamped { stamp: stamp_of(row, 2)?, digest }),
        None => None,
    };
    Ok(SideRow { path: path_of(row, 0)?, model: row.get(1)?, then })
}

/// Replaces the files that a model names.
pub(super) fn write_beside(
    connection: &Connection,
    id: i64,
    files: &[SideFile],
) -> rusqlite::Result<()> {
    connection.prepare_cached("DELETE FROM side_file WHERE model_id = ?1")?.execute([id])?;
    let insert = "INSERT OR REPLACE INTO side_file VALUES (?1,?2,?3,?4,?5,?6,?7)";
    let mut insert = connection.prepare_cached(insert)?;
    for file in files {
        let stamp = file.stamped.map(|stamped| stamped.stamp);
        insert.execute(params![
            bytes_of(&file.path.to_path()),
            id,
            stamp.map(|stamp| stamp.bytes as i64),
            stamp.map(|stamp| stamp.mtime_ns),
            stamp.map(|stamp| stamp.ctime_ns),
            stamp.map(|stamp| stamp.inode as i64),
            file.stamped.map(|stamped| stamped.digest),
        ])?;
    }
    Ok(())
}

impl Journal {
    /// Files that settled models of a run name, in order of their paths, `most` at most, from behind
    /// `last` on; a row of its own by default is in front of all.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn side_files_after(
        &mut self,
        run: i64,
        last: &SideRow,
        most: u32,
    ) -> Result<Vec<SideRow>, CatalogueError> {
        let asked = "SELECT side_file.path, model_id, bytes, mtime_ns, ctime_ns, inode, digest
            FROM side_file CROSS JOIN model ON model.id = model_id
            WHERE (side_file.path, model_id) > (?1, ?2) AND run_id = ?3
                AND state NOT IN ('pending', 'gone')
            ORDER BY side_file.path, model_id LIMIT ?4";
        self.with(|connection| {
            let words = params![bytes_of(&last.path), last.model, run, most];
            connection.prepare_cached(asked)?.query_map(words, row_of)?.collect()
        })
    }

    /// Notes what the file system says now of such a file whose content is as it was.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn set_side_stamp(
        &mut self,
        model: i64,
        path: &Path,
        stamp: &Stamp,
    ) -> Result<(), CatalogueError> {
        let update = "UPDATE side_file SET bytes = ?3, mtime_ns = ?4, ctime_ns = ?5, inode = ?6
            WHERE path = ?1 AND model_id = ?2";
        self.with(|connection| {
            let Stamp { bytes, mtime_ns, ctime_ns, inode } = *stamp;
            connection
                .prepare_cached(update)?
                .execute(params![
                    bytes_of(path),
                    model,
                    bytes as i64,
                    mtime_ns,
                    ctime_ns,
                    inode as i64
                ])
                .map(|_| ())
        })
    }

    /// The files that a model names, as people are told of them.
    pub(super) fn beside(&mut self, model: i64) -> Result<Vec<ToldBeside>, CatalogueError> {
        let asked = "SELECT path, digest IS NOT NULL FROM side_file WHERE model_id = ?1
            ORDER BY path";
        self.with(|connection| {
            let mut asked = connection.prepare(asked)?;
            let files = asked.query_map([model], |row| {
                let name = path_of(row, 0)?.to_string_lossy().into_owned();
                Ok(ToldBeside { name, is_there: row.get(1)? })
            })?;
            files.collect()
        })
    }
}
