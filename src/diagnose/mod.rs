//! The diagnosis: what is wrong with a model, beyond what the proof tells, before it is repaired.
//!
//! In:         a [`MeshSource`], read once into a [`Model`]: corners in file order, and vertices
//!             that are one where their positions are equal, exactly.
//! Out:        a [`Diagnosis`]: rims traced to loops, shells, duplicates, T-junctions, fins, hidden
//!             and tiny shells, thin walls, isolated vertices; each with its count and the first or
//!             largest places.
//! Invariant:  the result depends on the file and the [`Tolerances`] alone, not on the share. What
//!             is topology is decided on vertices, exactly; tolerances decide about distances only.
//! Units:      model units.
//! Memory:     about `share_bytes` whatever the file, 2 MiB for the grid of visibility, and 4 MiB
//!             for a vertex with very many triangles or a crowded cell.
//! Fails:      [`DiagnoseError`]: the source, the scratch disk, or a request to stop. What is wrong
//!             with the model is in the diagnosis.
//! Source:     Tarjan 1975 (unions); Ericson 2005, Real-time collision detection, 7.2 (hierarchical
//!             grids); the rest is ours.

mod duplicates;
mod edges;
mod error;
mod fans;
mod finding;
mod fins;
mod hidden;
mod inverted;
mod isolated;
mod loops;
mod marked;
mod model;
mod near;
mod ownership;
mod reading;
mod shells;
mod sight;
mod sums;
mod t_junctions;
#[cfg(test)]
mod tests;
mod thin;

pub use error::DiagnoseError;
pub use finding::{Finding, Measure, SizedPlaces};
pub use loops::LoopReport;
pub use model::{Model, ModelFacts, ModelSource};
pub use ownership::{Owner, Owners};
pub use shells::{ShellReport, ShellSummary};

use crate::defect::Marks;
use crate::diagnose::edges::Edges;
use crate::diagnose::shells::Shells;
#[cfg(doc)]
use crate::mesh::MeshSource;
use crate::monitor::Monitor;
use crate::store::{Scratch, StoreError};

/// What is small, near and thin, model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Walls thinner than this are told.
    pub thin: f64,
    /// Shells whose boxes have a smaller diagonal are told.
    pub tiny: f64,
    /// A vertex lies on an edge if it is no farther away.
    pub junction: f64,
}

/// What a diagnosis may use.
#[derive(Clone, Copy)]
pub struct Means<'m> {
    /// Where files without names lie.
    pub scratch: &'m Scratch,
    /// Memory for sorts, tables and unions, all of them together.
    pub share_bytes: u64,
    /// Who may stop the work.
    pub monitor: &'m dyn Monitor,
}

impl Means<'_> {
    /// Ends the work when the caller wants that.
    fn stop_if_asked(&self) -> Result<(), StoreError> {
        if self.monitor.cancelled() { Err(StoreError::Cancelled) } else { Ok(()) }
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// The rims.
    pub loops: LoopReport,
    /// The connected surfaces.
    pub shells: ShellReport,
    /// All edges between two vertices, each once.
    pub edges: u64,
    /// Length of the edges with more than two triangles, each once, model units.
    pub crowded_length: f64,
    /// What was looked for here, worst first; with a count of 0 where there is none.
    pub findings: Vec<Finding>,
}

/// Looks at a model that has been read, and marks all that has a defect if asked.
///
/// # Errors
/// The scratch disk fails, or the monitor asks to stop.
pub fn diagnose(
    model: &Model,
    tolerances: &Tolerances,
    marks: Option<&Marks>,
    means: &Means<'_>,
) -> Result<Diagnosis, StoreError> {
    let mut findings = Vec::new();
    findings.push(duplicates::find(model, marks, means)?);
    findings.push(isolated::find(model, marks, means)?);
    findings.push(model.coincident());
    if let Some(marks) = marks {
        model.mark_coincident(marks, means)?;
    }
    // What a look needs no more goes before the next one begins: each has most of the share.
    let Edges { shells: mut labels, mut sheets, sides, count } = Edges::find(model, means)?;
    findings.push(fins::find(model, &mut sheets, &sides, marks, means)?);
    drop(sheets);
    if let Some(marks) = marks {
        edges::mark(&sides, marks)?;
    }
    let mut shells = Shells::measure(model, &mut labels, &sides, means)?;
    drop(labels);
    findings.push(inverted::find(model, &mut shells, means)?);
    findings.push(hidden::find(model, &mut shells, means)?);
    let (report, mut of_shells) = shells.report(tolerances.tiny, means)?;
    findings.append(&mut of_shells);
    if let Some(marks) = marks {
        shells.mark(model, tolerances.tiny, marks, means)?;
    }
    drop(shells);
    let (rims, crowded_length) = loops::open_edges(model, &sides, means)?;
    drop(sides);
    let (loops, mut of_loops) = loops::trace(model, &rims, means)?;
    findings.append(&mut of_loops);
    findings.push(t_junctions::find(&rims, tolerances.junction, model, marks, means)?);
    drop(rims);
    findings.push(thin::find(model, tolerances.thin, marks, means)?);
    findings.sort_by_key(|finding| finding.kind);
    Ok(Diagnosis { loops, shells: report, edges: count, crowded_length, findings })
}
