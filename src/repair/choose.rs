//! Chooses the threshold whose surface has few enough triangles.
//!
//! In:         signs, and the most triangles that the surface may have.
//! Out:        a threshold of a fixed row that fits, where the one before it does not.
//! Invariant:  nothing is left in the work folder; the choice depends on signs and settings alone.
//! Units:      thresholds in cells.
//! Memory:     that of placing, separating and writing, one after the other.
//! Fails:      [`RepairError::TooManyTriangles`], or as placing and separating.

use crate::contour::{
    CELLS, ContourError, ContourOptions, SURFACE, count_triangles, place_vertices, separate,
};
use crate::octree::{Domain, SignBricks};
use crate::repair::RepairError;
use crate::store::{NoCheckpoints, Resources, StoreError, directory_name};

/// Larger thresholds are not tried: a cluster is no larger than a brick.
const LAST_CELLS: f64 = 1000.0;
/// Where the row goes on after 0.
const FIRST_CELLS: f64 = 0.01;
/// Four thresholds to an octave.
const OCTAVE: [f64; 4] =
    [1.0, 1.189_207_115_002_721, std::f64::consts::SQRT_2, 1.681_792_830_507_429];

/// The thresholds that may be chosen: `from_cells` and those above it.
fn row(from_cells: f64) -> Vec<f64> {
    let first = if from_cells > 0.0 { from_cells } else { FIRST_CELLS };
    let octaves = (0..).flat_map(|octave| OCTAVE.map(|step| first * step * 2_f64.powi(octave)));
    let above = octaves.take_while(|cells| *cells <= LAST_CELLS).filter(|c| *c > from_cells);
    [from_cells].into_iter().chain(above).collect()
}

/// The most thresholds that are tried.
pub fn most_trials(from_cells: f64) -> u64 {
    // Both ends, and the halvings between them.
    2 + u64::from(row(from_cells).len().next_power_of_two().ilog2())
}

/// The surfaces of one set of signs.
pub struct Trials<'t> {
    pub signs: SignBricks<'t>,
    pub domain: &'t Domain,
    /// All but the threshold.
    pub options: ContourOptions,
    pub resources: Resources<'t>,
}

impl Trials<'_> {
    /// A threshold, from that of the options up, whose surface has at most `limit` triangles,
    /// while that of the next finer one of the row has more.
    ///
    /// # Errors
    /// [`RepairError::TooManyTriangles`] when the last of the row has more; or as placing and
    /// separating.
    pub fn choose(&self, limit: u64) -> Result<f64, RepairError> {
        let row = row(self.options.decimate_cells);
        let first = self.triangles(row[0])?;
        if first <= limit {
            return Ok(row[0]);
        }
        let last = self.triangles(row[row.len() - 1])?;
        if last > limit {
            return Err(RepairError::TooManyTriangles { limit, fewest: first.min(last) });
        }
        // The threshold at `low` does not fit, that at `high` does.
        let (mut low, mut high) = (0, row.len() - 1);
        while high - low > 1 {
            let middle = low.midpoint(high);
            if self.triangles(row[middle])? <= limit { high = middle } else { low = middle }
        }
        Ok(row[high])
    }

    /// How many triangles the surface has at a threshold.
    fn triangles(&self, decimate_cells: f64) -> Result<u64, RepairError> {
        let triangles = self.trial(decimate_cells).map_err(RepairError::Contour)?;
        let note = format!("{triangles} triangles at {decimate_cells} cells");
        self.resources.monitor.note(&note);
        Ok(triangles)
    }

    fn trial(&self, decimate_cells: f64) -> Result<u64, ContourError> {
        // A trial is done again from its start: what it leaves is listed nowhere.
        let resources = Resources { checkpoints: &NoCheckpoints, ..self.resources };
        let options = ContourOptions { decimate_cells, ..self.options };
        let (signs, domain) = (self.signs, self.domain);
        let (cells, placed) = place_vertices(signs, domain, &options, &resources)?;
        let (surface, _) = separate(signs, &cells, domain, &options, &placed, &resources)?;
        let triangles = count_triangles((&cells, &surface), domain, &options, &resources)?;
        drop((cells, surface));
        self.remove([CELLS, SURFACE])?;
        Ok(triangles)
    }

    fn remove(&self, names: [&str; 2]) -> Result<(), StoreError> {
        for name in names {
            self.resources.scratch.remove(name)?;
            self.resources.scratch.remove(&directory_name(name))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_grow_by_quarters_of_an_octave_from_the_one_that_was_asked_for() {
        for from in [0.0, 0.003, 0.1, 7.0, 999.0, 5000.0] {
            let row = row(from);
            assert_eq!(row[0], from);
            assert!(row.is_sorted_by(|a, b| a < b), "{row:?}");
            let start = usize::from(from == 0.0);
            for pair in row[start..].windows(2) {
                assert!((pair[1] / pair[0] - 2_f64.powf(0.25)).abs() < 1e-12, "{pair:?}");
            }
            assert!(row[1..].iter().all(|cells| *cells <= LAST_CELLS));
            assert!(from > LAST_CELLS / 1.2 || row[row.len() - 1] > LAST_CELLS / 1.2);
        }
        assert_eq!((most_trials(0.1), most_trials(0.0)), (8, 9));
    }
}
