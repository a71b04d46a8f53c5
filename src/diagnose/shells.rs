//! The connected surfaces of a model.
//!
//! In:         triangles joined over edges; the sides of triangles at edges that have not two.
//! Out:        sums of every shell; those that are open, those that are tiny.

use std::cmp::Reverse;

use serde::{Deserialize, Serialize};

use crate::defect::{Defect, DefectKind, Marks, OpenShell, Smallest, TinyShell};
use crate::diagnose::Means;
use crate::diagnose::edges::Side;
use crate::diagnose::finding::{Finding, Measure, SizedPlaces};
use crate::diagnose::model::Model;
use crate::diagnose::sums::{Sets, Sums};
use crate::store::{Labels, Sequence, StoreError};

/// All shells.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShellReport {
    /// Sets of triangles that hang together over edges.
    pub count: u64,
    /// Those without boundary edges.
    pub closed: u64,
    /// Those whose edges all have two triangles.
    pub manifold: u64,
    /// The eight with the largest areas, largest first.
    pub largest: Vec<ShellSummary>,
}

/// One shell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShellSummary {
    /// Its first triangle in the file, from 0.
    pub triangle: u64,
    /// Its triangles.
    pub triangles: u64,
    /// Whether it has no boundary edge.
    pub is_closed: bool,
    /// Whether nobody sees it.
    pub is_hidden: bool,
    /// Area, model units squared.
    pub area: f64,
    /// Signed volume, cubed model units; of closed ones.
    pub volume: Option<f64>,
    /// Lowest and highest corner.
    pub bounds: [[f64; 3]; 2],
}

/// The shells of a model.
pub(crate) struct Shells {
    sets: Sets,
}

impl Shells {
    /// Adds up every shell.
    pub(crate) fn measure(
        model: &Model,
        labels: &mut Labels,
        sides: &Sequence<Side>,
        means: &Means<'_>,
    ) -> Result<Self, StoreError> {
        Ok(Self { sets: Sets::measure(model, labels, sides, means)? })
    }

    /// How many there are.
    pub(crate) fn len(&self) -> u64 {
        self.sets.sums.len()
    }

    /// The shell of a whole triangle.
    pub(crate) fn of(&mut self, triangle: u64) -> Result<u64, StoreError> {
        Ok(self.sets.set_of.get(triangle)?.into())
    }

    /// What a shell adds up to.
    pub(crate) fn sums(&mut self, shell: u64) -> Result<Sums, StoreError> {
        self.sets.sums.get(shell)
    }

    /// Notes that something of a shell is seen.
    pub(crate) fn see(&mut self, shell: u64) -> Result<(), StoreError> {
        let mut sums = self.sets.sums.get(shell)?;
        sums.is_seen = 1;
        self.sets.sums.set(shell, sums)
    }

    /// Notes that a shell is inside out.
    pub(crate) fn turn(&mut self, shell: u64) -> Result<(), StoreError> {
        let mut sums = self.sets.sums.get(shell)?;
        sums.is_inward = 1;
        self.sets.sums.set(shell, sums)
    }

    /// Marks the triangles of shells by what their shells are, once all of that is known.
    pub(crate) fn mark(
        &mut self,
        model: &Model,
        tiny: f64,
        marks: &Marks,
        means: &Means<'_>,
    ) -> Result<(), StoreError> {
        model.each(means, |triangle| {
            if !triangle.is_whole() {
                return Ok(());
            }
            let shell = self.of(triangle.number)?;
            let sums = self.sums(shell)?;
            for (kind, is_one) in [
                (DefectKind::InwardComponent, sums.is_inward == 1),
                (DefectKind::OpenShell, sums.open_sides > 0),
                (DefectKind::HiddenShell, sums.is_seen == 0),
                (DefectKind::TinyShell, sums.diagonal() < tiny),
            ] {
                if is_one {
                    marks.triangles(kind, &[triangle.number as u32])?;
                }
            }
            Ok(())
        })
    }

    /// Tells of all shells, once it is known which are seen.
    pub(crate) fn report(
        &mut self,
        tiny: f64,
        means: &Means<'_>,
    ) -> Result<(ShellReport, Vec<Finding>), StoreError> {
        let mut report = ShellReport { count: self.len(), ..ShellReport::default() };
        let (mut open, mut small) = (Tally::default(), Tally::default());
        let mut largest = Smallest::new();
        for shell in 0..self.len() {
            if shell % 4096 == 0 {
                means.stop_if_asked()?;
            }
            let sums = self.sums(shell)?;
            let (triangle, triangles, position) = (sums.first, sums.triangles, sums.position);
            let is_closed = sums.open_sides == 0;
            report.closed += u64::from(is_closed);
            report.manifold += u64::from(is_closed && sums.hinge_sides == 0);
            let by_area = Reverse(sums.area.max(0.0).to_bits());
            largest.offer((by_area, triangle), shell);
            if !is_closed {
                let (area, open_share) = (sums.area, sums.open_share());
                let defect = OpenShell { triangle, triangles, area, open_share, position };
                open.add(area, triangle, Defect::OpenShell(defect));
            }
            if sums.diagonal() < tiny {
                let diagonal = sums.diagonal();
                let defect = TinyShell { triangle, triangles, diagonal, position };
                small.add(diagonal, triangle, Defect::TinyShell(defect));
            }
        }
        for &(_, shell) in largest.iter() {
            report.largest.push(self.summary(shell)?);
        }
        let size = (Measure::TotalArea, open.total);
        let places = open.largest.into_places();
        let open = Finding::sized(DefectKind::OpenShell, open.count, size, places);
        let places = small.largest.into_places();
        let small = Finding::counted(DefectKind::TinyShell, small.count, places);
        Ok((report, vec![open, small]))
    }

    fn summary(&mut self, shell: u64) -> Result<ShellSummary, StoreError> {
        let sums = self.sums(shell)?;
        let is_closed = sums.open_sides == 0;
        Ok(ShellSummary {
            triangle: sums.first,
            triangles: sums.triangles,
            is_closed,
            is_hidden: sums.is_seen == 0,
            area: sums.area,
            volume: is_closed.then_some(sums.six_volumes / 6.0),
            bounds: [sums.low, sums.high],
        })
    }
}

/// Shells of one kind.
#[derive(Default)]
struct Tally {
    count: u64,
    total: f64,
    largest: SizedPlaces,
}

impl Tally {
    fn add(&mut self, size: f64, number: u64, defect: Defect) {
        self.count += 1;
        self.total += size;
        self.largest.offer(size, number, defect);
    }
}
