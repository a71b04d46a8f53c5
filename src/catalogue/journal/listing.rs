//! The journal's answers for a report: totals, groups, and one model after the other.

use std::path::PathBuf;

use rusqlite::Row;

use crate::catalogue::CatalogueError;
use crate::catalogue::journal::Journal;
use crate::catalogue::journal::enrol::path_of;

/// Sums over all models.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Models that were ever seen.
    pub models: u64,
    /// Bytes of the models.
    pub input_bytes: u64,
    /// Bytes of the results.
    pub result_bytes: u64,
    /// Triangles of those that were repaired.
    pub triangles_before: u64,
    /// Triangles of their results.
    pub triangles_after: u64,
    /// Wall time of the last attempts.
    pub seconds: f64,
    /// Processor time of their workers.
    pub cpu_seconds: f64,
    /// The largest peak memory of a worker.
    pub peak_bytes: u64,
}

/// A number of the outcome, over all models that have one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutcomeSum {
    /// Models where it is above zero.
    pub models: u64,
    /// Its sum.
    pub sum: u64,
}

/// Failures for one reason.
#[derive(Clone, Debug, PartialEq)]
pub struct CauseGroup {
    /// Name of a [`crate::catalogue::Cause`].
    pub cause: String,
    /// How many.
    pub models: u64,
    /// Wall time of their last attempts.
    pub seconds: f64,
}

/// A model in a list.
#[derive(Clone, Debug, PartialEq)]
pub struct ListedModel {
    /// Its number in the journal.
    pub id: i64,
    /// Its path within the folder of the models, as text.
    pub name: String,
    /// Path of its result within the folder of the results.
    pub output: PathBuf,
    /// Name of a [`crate::catalogue::State`].
    pub state: String,
    /// Pass, review or fail, of repaired ones.
    pub verdict: Option<String>,
    /// Name of a [`crate::catalogue::Cause`], of failed ones.
    pub cause: Option<String>,
    /// In one line.
    pub reason: Option<String>,
    /// What it took.
    pub seconds: Option<f64>,
    /// Peak memory of its worker.
    pub peak_bytes: Option<u64>,
    /// Bytes of the model.
    pub input_bytes: u64,
    /// Triangles of the model, if it was repaired.
    pub triangles_before: Option<u64>,
    /// Triangles of its result.
    pub triangles_after: Option<u64>,
    /// Depth of the grid.
    pub depth: Option<u32>,
}

/// Which models a list begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ListOrder {
    /// What a person should look at first, then by name.
    Urgency,
    /// Those that took longest.
    Slowest,
    /// Those of most bytes.
    Largest,
    /// The failed ones of this cause alone, by name.
    FailedFor(&'static str),
}

const COLUMNS: &str =
    "id, name, coalesce(result, output), state, verdict, cause, reason, seconds, peak_bytes,
    input_bytes, triangles_before, triangles_after, depth";

fn listed_of(row: &Row) -> rusqlite::Result<ListedModel> {
    let number = |column| -> rusqlite::Result<Option<u64>> {
        Ok(row.get::<_, Option<i64>>(column)?.map(|value| value as u64))
    };
    Ok(ListedModel {
        id: row.get(0)?,
        name: row.get(1)?,
        output: path_of(row, 2)?,
        state: row.get(3)?,
        verdict: row.get(4)?,
        cause: row.get(5)?,
        reason: row.get(6)?,
        seconds: row.get(7)?,
        peak_bytes: number(8)?,
        input_bytes: number(9)?.unwrap_or_default(),
        triangles_before: number(10)?,
        triangles_after: number(11)?,
        depth: row.get(12)?,
    })
}

impl ListOrder {
    /// In SQL, what follows upon `FROM model`.
    fn clause(self) -> String {
        match self {
            Self::Urgency => "ORDER BY CASE
                    WHEN state = 'failed' OR verdict = 'fail' THEN 0 WHEN state = 'degraded' THEN 1
                    WHEN verdict = 'review' THEN 2 WHEN state = 'pending' THEN 3
                    WHEN state = 'gone' THEN 5 ELSE 4 END, name, id"
                .to_owned(),
            Self::Slowest => "WHERE seconds IS NOT NULL ORDER BY seconds DESC, id".to_owned(),
            Self::Largest => "ORDER BY input_bytes DESC, id".to_owned(),
            Self::FailedFor(cause) => {
                format!("WHERE state = 'failed' AND cause = '{cause}' ORDER BY name, id")
            }
        }
    }
}

impl Journal {
    /// Answers of `ask` that all see the journal at one moment, whatever a batch writes meanwhile.
    ///
    /// # Errors
    /// The journal cannot be read, or what `ask` says.
    pub fn at_one_moment<T, E: From<CatalogueError>>(
        &mut self,
        ask: impl FnOnce(&mut Self) -> Result<T, E>,
    ) -> Result<T, E> {
        self.with(|connection| connection.execute_batch("BEGIN"))?;
        let answer = ask(self);
        // Nothing was written, so how it ends changes nothing.
        let ended = self.with(|connection| connection.execute_batch("ROLLBACK"));
        let answer = answer?;
        ended?;
        Ok(answer)
    }

    /// Sums over all models.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn totals(&mut self) -> Result<Totals, CatalogueError> {
        let asked = "SELECT count(*), coalesce(sum(input_bytes), 0),
                (SELECT coalesce(sum(bytes), 0) FROM output_file WHERE model_id IN
                    (SELECT id FROM model WHERE state IN ('copied', 'repaired', 'degraded'))),
                coalesce(sum(triangles_before), 0), coalesce(sum(triangles_after), 0),
                coalesce(sum(seconds), 0.0), coalesce(sum(cpu_seconds), 0.0),
                coalesce(max(peak_bytes), 0) FROM model";
        self.with(|connection| {
            connection.query_row(asked, (), |row| {
                let number = |column| row.get::<_, i64>(column).map(|value| value as u64);
                Ok(Totals {
                    models: number(0)?,
                    input_bytes: number(1)?,
                    result_bytes: number(2)?,
                    triangles_before: number(3)?,
                    triangles_after: number(4)?,
                    seconds: row.get(5)?,
                    cpu_seconds: row.get(6)?,
                    peak_bytes: number(7)?,
                })
            })
        })
    }

    /// Sums of counts of the outcomes, by their paths in docs/outcome.md; in that order.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn outcome_sums(
        &mut self,
        fields: &[&'static str],
    ) -> Result<Vec<OutcomeSum>, CatalogueError> {
        let sums: Vec<String> = fields
            .iter()
            .map(|field| format!("outcome ->> '$.{field}'"))
            .map(|value| format!("coalesce(sum({value}), 0), count(nullif({value}, 0))"))
            .collect();
        let asked = format!("SELECT {} FROM model WHERE outcome IS NOT NULL", sums.join(", "));
        self.with(|connection| {
            connection.query_row(&asked, (), |row| {
                (0..fields.len())
                    .map(|field| {
                        let sum = row.get::<_, i64>(2 * field)? as u64;
                        Ok(OutcomeSum { sum, models: row.get::<_, i64>(2 * field + 1)? as u64 })
                    })
                    .collect()
            })
        })
    }

    /// Why models failed, the most frequent reason first.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn causes(&mut self) -> Result<Vec<CauseGroup>, CatalogueError> {
        let asked = "SELECT coalesce(cause, ''), count(*), coalesce(sum(seconds), 0.0) FROM model
            WHERE state = 'failed' GROUP BY cause ORDER BY count(*) DESC, cause";
        self.with(|connection| {
            let mut asked = connection.prepare(asked)?;
            let groups = asked.query_map((), |row| {
                Ok(CauseGroup {
                    cause: row.get(0)?,
                    models: row.get::<_, i64>(1)? as u64,
                    seconds: row.get(2)?,
                })
            })?;
            groups.collect()
        })
    }

    /// Shows models to `take`, one after the other, `most` at most.
    ///
    /// # Errors
    /// The journal cannot be read, or what `take` says.
    pub fn each_model<E: From<CatalogueError>>(
        &mut self,
        order: ListOrder,
        most: Option<u64>,
        mut take: impl FnMut(ListedModel) -> Result<(), E>,
    ) -> Result<(), E> {
        let limit = most.map_or(-1, |most| i64::try_from(most).unwrap_or(i64::MAX));
        let asked = format!("SELECT {COLUMNS} FROM model {} LIMIT ?1", order.clause());
        let mut taken = Ok(());
        self.with(|connection| {
            let mut asked = connection.prepare(&asked)?;
            let mut rows = asked.query([limit])?;
            while let Some(row) = rows.next()? {
                taken = take(listed_of(row)?);
                if taken.is_err() {
                    break;
                }
            }
            Ok(())
        })?;
        taken
    }
}
