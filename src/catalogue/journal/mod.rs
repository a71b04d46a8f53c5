//! The journal: what is known of every model, in a database that people may query.
//!
//! In:         what the batch finds and does, as it happens.
//! Out:        the tables of `schema.sql`; those of older versions become such.
//! Invariant:  what a call has written outlives the process; a batch that was killed leaves attempts
//!             without an end, and nothing half written. One process writes, any number reads.
//! Memory:     the cache of the database, 2 MiB.
//! Fails:      [`CatalogueError::Journal`]: the disk is full, or the file is not ours.

mod attempts;
mod enrol;
mod finish;
mod listing;
mod models;
mod schema;
mod side_files;
mod summary;

pub use attempts::AttemptRow;
pub use enrol::{Enrolled, Seen};
pub use finish::Finished;
pub use listing::{CauseGroup, ListOrder, ListedModel, OutcomeSum, Totals};
pub use models::ModelRow;
pub use side_files::SideRow;
pub use summary::{Failure, StateCount, Summary, Told, ToldBeside, UnderWay};

use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, OpenFlags};

use crate::catalogue::CatalogueError;
use crate::catalogue::journal::schema::SCHEMA;

/// Folder of a catalogue's own files, in that of the results.
pub const FOLDER: &str = ".brickmend";
/// The journal in it.
pub const JOURNAL: &str = "journal.sqlite";
/// How long one process waits for another's transaction.
const PATIENCE: Duration = Duration::from_secs(30);

/// An open journal.
pub struct Journal {
    path: PathBuf,
    connection: Connection,
}

impl Journal {
    /// Opens the journal of the results in `target`, takes it over from an older version, or begins
    /// it. The caller holds the lock of the
    /// folder: two processes that begin a journal at once would be in each other's way.
    ///
    /// # Errors
    /// The file cannot be used, or is of another version.
    pub fn open(target: &Path) -> Result<Self, CatalogueError> {
        let path = target.join(FOLDER).join(JOURNAL);
        let connection = Connection::open(&path).map_err(|e| failed(&path, e))?;
        let mut journal = Self { path, connection };
        journal.prepare().or_else(|error| journal.fail(error))?;
        journal.check_schema()?;
        Ok(journal)
    }

    /// Opens the journal to look at it, also while a batch writes it.
    ///
    /// # Errors
    /// [`CatalogueError::NoJournal`], or as for [`Journal::open`].
    pub fn open_to_read(target: &Path) -> Result<Self, CatalogueError> {
        let path = target.join(FOLDER).join(JOURNAL);
        if !path.is_file() {
            return Err(CatalogueError::NoJournal { folder: target.to_path_buf() });
        }
        // A reader of a journal that is being written has to write into its index.
        let writable = Connection::open_with_flags(&path, OpenFlags::SQLITE_OPEN_READ_WRITE);
        let connection = writable
            .or_else(|_| Connection::open_with_flags(&path, OpenFlags::SQLITE_OPEN_READ_ONLY))
            .map_err(|e| failed(&path, e))?;
        let journal = Self { path, connection };
        let patient = journal.connection.busy_timeout(PATIENCE);
        patient
            .and_then(|()| schema::look_as_it_is(&journal.connection))
            .and_then(|()| journal.connection.pragma_update(None, "query_only", true))
            .or_else(|error| journal.fail(error))?;
        journal.check_schema()?;
        Ok(journal)
    }

    fn prepare(&mut self) -> rusqlite::Result<()> {
        self.connection.busy_timeout(PATIENCE)?;
        self.connection.pragma_update(None, "journal_mode", "WAL")?;
        self.connection.pragma_update(None, "synchronous", "NORMAL")?;
        self.connection.pragma_update(None, "foreign_keys", true)?;
        schema::prepare(&mut self.connection)
    }

    fn check_schema(&self) -> Result<(), CatalogueError> {
        match schema::found(&self.connection).or_else(|error| self.fail(error))? {
            Some(found) if schema::is_known(&found) => Ok(()),
            found => Err(CatalogueError::OtherSchema {
                path: self.path.clone(),
                found: found.unwrap_or_default(),
                expected: SCHEMA.to_owned(),
            }),
        }
    }

    fn fail<T>(&self, error: rusqlite::Error) -> Result<T, CatalogueError> {
        Err(failed(&self.path, error))
    }

    /// What `work` does with the database.
    fn with<T>(
        &mut self,
        work: impl FnOnce(&mut Connection) -> rusqlite::Result<T>,
    ) -> Result<T, CatalogueError> {
        work(&mut self.connection).map_err(|error| failed(&self.path, error))
    }
}

pub(crate) fn failed(path: &Path, source: rusqlite::Error) -> CatalogueError {
    CatalogueError::Journal { path: path.to_path_buf(), source }
}

impl CatalogueError {
    /// Whether a disk is full.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        match self {
            Self::Journal { source, .. } => {
                source.sqlite_error_code() == Some(rusqlite::ErrorCode::DiskFull)
            }
            Self::Store(error) => error.is_disk_full(),
            _ => false,
        }
    }
}
