//! What a comparison tells. See docs/verify.md.

use serde::{Deserialize, Serialize};

/// How far a file lies from its original.
///
/// Lengths are in model units. Shares and means are estimates by samples, exact for the samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// What lies farther away is lost or invented.
    pub tolerance: f64,
    /// Side of a cell, where one is known.
    pub cell_size: Option<f64>,
    /// Diagonal of the original's box.
    pub diagonal: f64,
    /// From samples of the original to the file.
    pub original_to_file: Distances,
    /// From samples of the file to the original.
    pub file_to_original: Distances,
    /// What of the original can be seen, and the file lacks.
    pub lost: LostReport,
    /// Share of the file's area that lies farther from the original than the tolerance.
    pub invented_share: f64,
    /// Sharp edges of the original, and what the file has in their places; `None` where they were not
    /// sought.
    pub creases: Option<CreaseReport>,
}

/// Distances from the samples of one surface to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Samples spread over the area.
    pub samples: u64,
    /// Corners of triangles that were measured besides: they count for the largest distance alone.
    pub corners: u64,
    /// Mean over the area.
    pub mean: f64,
    /// Root of the mean square over the area.
    pub rms: f64,
    /// 99.9 % of the area lie no farther away.
    pub p999: f64,
    /// Where the largest distance is, of samples and corners; `None` where there are none.
    pub largest: Option<Separation>,
    /// The same in cells, where their size is known: mean, root of the mean square, 99.9 %, largest.
    pub in_cells: Option<[f64; 4]>,
    /// How much normals differ.
    pub normals: Normals,
}

/// Two points, and how far they lie apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Separation {
    /// Their distance.
    pub distance: f64,
    /// The point of the surface that is measured.
    pub position: [f64; 3],
    /// The point of the other one that is nearest to it.
    pub nearest: [f64; 3],
}

/// Angles between the normals of samples and those of the triangles nearest to them, 0 to 90
/// degrees: which way triangles face does not matter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Normals {
    /// Half of the area differs by no more.
    pub median_deg: f64,
    /// 99 % of the area differ by no more.
    pub p99_deg: f64,
}

/// What of the original can be seen from outside, and lies farther from the file than the tolerance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostReport {
    /// Share of the original's area that can be seen.
    pub visible_share: f64,
    /// Share of what can be seen that the file lacks.
    pub share: f64,
    /// Where of what can be seen the file is farthest away; `None` where nothing is seen.
    pub largest: Option<Separation>,
}

/// Sharp edges: of exactly two triangles, which leave the plane of each other by more than 30
/// degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CreaseReport {
    /// Length of those of the original.
    pub length: f64,
    /// Part of that length with both sides visible.
    pub visible_length: f64,
    /// Length of those of the file.
    pub file_length: f64,
    /// Share of the visible length that has a sharp edge of the file within the tolerance; `None`
    /// where there is no such length.
    pub kept_share: Option<f64>,
    /// A visible place that is farthest from the sharp edges of the file; `None` where either has
    /// none.
    pub largest: Option<Separation>,
}
