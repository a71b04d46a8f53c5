//! Mends the soup before it is scanned: open sheets become walls, holes are filled.
//!
//! A *sheet* is a set of triangles joined across the edges that exactly two of them meet. Its
//! *rim* is made of the edges that an odd number of its triangles meets. A piece of rim is
//! *covered* where something closes it: another rim that faces it (a crack), or a face that it
//! ends on (a T-junction). Sheets whose rims cover each other are one *shell*. What is left open of
//! a shell are its *openings*: one that is large for its shell is wanted, and the shell gets walls
//! with thickness; any other is filled with triangles. Cracks narrower than a cell are left to the
//! scan, which they do not bother, and all that is tangled to the patch. Panes, which light passes,
//! cover nothing opaque and are walls of their own; an opening beside a pane is wanted.
//!
//! In:         bins of the soup, without what was dropped.
//! Out:        [`Mended`]: triangles in bins that are added, and the drops with those of sheets
//!             that became walls.
//! Invariant:  what is added is closed mod 2 or closes a rim exactly; the answer does not depend on
//!             any share or thread, nor on where the planes of the grid lie but by what a cell is.
//! Units:      model units; reach and thickness are settings in cells.
//! Memory:     the share; tables over triangles and rims spill; the rims of one shell are in memory,
//!             up to [`MOST_RIMS`], a larger one is left to the patch and counted.
//! Fails:      [`StoreError`].
//! Source:     the rules are ours; rims that face each other after Barequet, Sharir 1995, Filling
//!             gaps in the boundary of a polyhedron.

mod contacts;
mod cracks;
pub mod fill;
mod loops;
mod losses;
mod miters;
mod openings;
pub mod pair;
mod rims;
mod samples;
mod sheets;
mod shells;
mod thicken;
mod walls;

use serde::{Deserialize, Serialize};

use crate::bridge::contacts::find_contacts;
use crate::bridge::openings::decide;
use crate::bridge::rims::find_rims;
use crate::bridge::sheets::Sheets;
use crate::bridge::shells::Shells;
use crate::bridge::walls::raise_walls;
use crate::octree::{
    BinEntry, BinSpools, BinTriangle, BinnedSoup, Domain, DropRecord, Panes, SnapBox, SoupEdges,
    SoupSpool, SoupTriangle, for_each_touched_brick, write_bins,
};
use crate::store::{FileState, Resources, Sorter, Spool, SpoolWriter, StoreError};

pub use loops::MOST_RIMS;
pub use thicken::{SLAB_ORIGINS, THICKENED, ThickenStats, Thickened, thicken};

/// Spools of the triangles that were added, of their bins, and of all triangles that do not count.
pub const ADDED: &str = "added.spool";
/// See [`ADDED`].
pub const ADDED_ENTRIES: &str = "added.entries";
/// Spool of the triangles whose texture coordinates and colours added ones have, one after the
/// other; empty where nobody asks.
pub const ORIGINS: &str = "added.origins";
/// See [`ADDED`].
pub const LEFT_OUT: &str = "leftout.spool";

/// What is closer than this touches, whatever gap is to be closed.
const LEAST_GAP_CELLS: f64 = 0.01;

/// Spools that live within this stage.
pub const PASSING: [&str; 2] = ["borders.spool", "rims.spool"];

/// Which openings are filled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HoleRule {
    /// Those that are small for their shell.
    #[default]
    Auto,
    /// All that are not the sheet itself.
    All,
    /// Those that are no wider than this, model units.
    UpTo(f64),
}

/// What mending goes by. Lengths in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MendOptions {
    /// Which openings are filled.
    pub holes: HoleRule,
    /// Rims closer than this cover each other.
    pub max_gap: f64,
    /// Thickness of walls.
    pub thickness: f64,
    /// Smaller angles between triangles are noise, degrees.
    pub crease_deg: f64,
    /// Box of the soup: walls reach beyond it by half their thickness at most.
    pub bounds: SnapBox,
    /// Whether it is kept which triangle an added one comes from.
    pub keeps_origins: bool,
}

/// Counts of mending. Lengths and areas in model units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MendStats {
    /// Sheets that have a rim.
    pub sheets: u64,
    /// Shells of them that are open somewhere.
    pub open_shells: u64,
    /// Shells that became walls.
    pub walled_shells: u64,
    /// Their triangles.
    pub walled_triangles: u64,
    /// Their area, counted once.
    pub walled_area: f64,
    /// Triangles of walls and fills; their source numbers follow upon those of the input.
    pub added_triangles: u64,
    /// Length of the rims that strips were put between, both sides.
    pub joined_length: f64,
    /// Openings that were filled.
    pub filled_holes: u64,
    /// Of these, those that go on smoothly as the surface around does.
    pub smooth_holes: u64,
    /// Area of the fills.
    pub filled_area: f64,
    /// Openings that were left open since they are wanted.
    pub wanted_openings: u64,
    /// Rim edges of shells, or soups, with too many of them, left to the patch.
    pub crowded_rims: u64,
    /// Places on rims, about one a cell, that lie with too many others in one brick to look at them.
    pub crowded_samples: u64,
    /// Length of open rim that was left to the patch.
    pub patched_length: f64,
    /// The widest holes that were filled.
    pub widest_holes: Vec<FilledHole>,
}

/// A hole that was filled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilledHole {
    /// Corners of its box, model units.
    pub lo: [f64; 3],
    /// See `lo`.
    pub hi: [f64; 3],
    /// Area of the fill, model units squared.
    pub area: f64,
    /// Edges of its rim.
    pub edges: u64,
}

/// What mending leaves.
pub struct Mended {
    /// Triangles to leave out, by brick and source number.
    pub left_out: Spool<DropRecord>,
    /// Triangles that were added.
    pub triangles: SoupSpool,
    /// Their bins.
    pub entries: Spool<BinEntry>,
    /// See [`ORIGINS`].
    pub origins: Spool<u32>,
}

impl Mended {
    /// Opens what an earlier run left.
    ///
    /// # Errors
    /// It is missing or damaged.
    pub fn open(resources: &Resources, files: &[FileState]) -> Result<Self, StoreError> {
        let scratch = resources.scratch;
        Ok(Self {
            left_out: Spool::open(scratch, FileState::find(files, LEFT_OUT)?)?,
            triangles: SoupSpool::open(scratch, FileState::find(files, ADDED)?)?,
            entries: Spool::open(scratch, FileState::find(files, ADDED_ENTRIES)?)?,
            origins: Spool::open(scratch, FileState::find(files, ORIGINS)?)?,
        })
    }

    /// The files, as they have to be found again.
    #[must_use]
    pub fn files(&self) -> Vec<FileState> {
        vec![
            self.left_out.state().clone(),
            self.triangles.state().clone(),
            self.entries.state().clone(),
            self.origins.state().clone(),
        ]
    }

    /// The soup in these bins, mended.
    #[must_use]
    pub fn soup<'b>(&'b self, bins: BinSpools<'b>) -> BinnedSoup<'b> {
        let added = BinSpools { triangles: &self.triangles, entries: &self.entries };
        BinnedSoup { bins, drops: &self.left_out, added: Some(added) }
    }
}

/// What is known of a soup that is to be mended.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// How many source numbers there are.
    pub triangles: u64,
    /// Edges with an odd number of triangles.
    pub rim_edges: u64,
    /// Whether light passes some of them.
    pub has_panes: bool,
}

/// Mends a soup.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn mend(
    soup: &BinnedSoup,
    options: &MendOptions,
    domain: &Domain,
    known: Known,
    resources: &Resources,
) -> Result<(Mended, MendStats), StoreError> {
    let least_gap = LEAST_GAP_CELLS * domain.cell_size();
    let options = &MendOptions { max_gap: options.max_gap.max(least_gap), ..*options };
    let Known { triangles, rim_edges, has_panes } = known;
    let mut stats = MendStats::default();
    let mut added = Added::new(domain, triangles, options, ORIGINS, resources)?;
    let mut drops = Sorter::<DropRecord>::new(resources.scratch, resources.share_bytes / 4);
    if triangles > sheets::MOST_TRIANGLES {
        stats.crowded_rims = rim_edges;
    } else if rim_edges > 0 || has_panes {
        mend_open(soup, options, (&mut added, &mut drops), &mut stats, resources)?;
    }
    stats.added_triangles = added.next - triangles;
    let mut reader = soup.drops.reader(0, soup.drops.len());
    while let Some(block) = reader.next_block()? {
        drops.extend(block)?;
    }
    let mut left_out = SpoolWriter::create(resources.scratch, LEFT_OUT)?;
    let mut sorted = drops.finish()?;
    while let Some(record) = sorted.next()? {
        left_out.push(record)?;
    }
    let left_out = left_out.finish()?;
    let (triangles, entries) = write_bins(added.bins, [ADDED, ADDED_ENTRIES], resources)?;
    let origins = added.origins.finish()?;
    for name in PASSING {
        resources.scratch.remove(name)?;
    }
    Ok((Mended { left_out, triangles, entries, origins }, stats))
}

fn mend_open(
    soup: &BinnedSoup,
    options: &MendOptions,
    (added, drops): (&mut Added, &mut Sorter<DropRecord>),
    stats: &mut MendStats,
    resources: &Resources,
) -> Result<(), StoreError> {
    let domain = added.domain;
    let SoupEdges { pairs, borders } = SoupEdges::find(soup, domain, Panes::Apart, resources)?;
    let mut sheets = Sheets::join(pairs, added.first, resources)?;
    let borders = sheets::spool_borders(borders, resources)?;
    let rims = find_rims(soup, &borders, &mut sheets, domain, resources)?;
    stats.sheets = sheets.count();
    if rims.is_empty() {
        return Ok(());
    }
    let (contacts, crowded) = find_contacts(soup, &rims, &mut sheets, options, domain, resources)?;
    stats.crowded_samples = crowded;
    let mut shells = Shells::new(&rims, contacts, &mut sheets, options, domain, resources)?;
    shells.measure(soup, &mut sheets)?;
    decide(&rims, &mut shells, options, added, stats, resources)?;
    if stats.walled_shells > 0 {
        raise_walls(soup, &borders, &mut sheets, &mut shells, options, (added, drops), resources)?;
    }
    Ok(())
}

/// What an added triangle has from one of the soup.
#[derive(Clone, Copy)]
struct Like {
    part: u32,
    material: u32,
    /// Source number of a triangle whose body it belongs to.
    of: u32,
    /// Source number of the triangle whose material it has.
    from: u32,
}

/// Triangles that are added, on their way into bins.
struct Added<'a> {
    domain: &'a Domain,
    bins: Sorter<BinTriangle>,
    /// Source number of the first one.
    first: u64,
    next: u64,
    origins: SpoolWriter<u32>,
    keeps_origins: bool,
}

impl<'a> Added<'a> {
    fn new(
        domain: &'a Domain,
        first: u64,
        options: &MendOptions,
        origins: &str,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let bins = Sorter::new(resources.scratch, resources.share_bytes / 4);
        let origins = SpoolWriter::create(resources.scratch, origins)?;
        let keeps_origins = options.keeps_origins;
        Ok(Self { domain, bins, first, next: first, origins, keeps_origins })
    }

    /// Adds a triangle like this one.
    fn push(&mut self, corners: [[f64; 3]; 3], like: Like) -> Result<(), StoreError> {
        let limit = u64::from(u32::MAX);
        if self.next > limit {
            return Err(StoreError::TooMany { what: "Triangles", limit });
        }
        let Like { part, material, of, from } = like;
        let (source, stands_for) = (self.next as u32, of + 1);
        self.next += 1;
        if self.keeps_origins {
            self.origins.push(from)?;
        }
        let triangle = SoupTriangle { corners, source, part, material, stands_for };
        let snapped = corners.map(|corner| self.domain.snap(corner));
        for_each_touched_brick(self.domain, snapped, &mut |key| {
            self.bins.push(BinTriangle { brick: key.0, triangle })
        })
    }
}
