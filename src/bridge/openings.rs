//! Decides what becomes of each shell: it stays, its openings are filled, or it becomes walls.
//!
//! An opening is wanted if its flat fill would add more than [`WANTED_SHARE`] to the area of its
//! shell: a basket, a bowl, a lampshade, an open drawer, and every free panel, whose fill would be
//! the panel itself. A shell with a wanted opening becomes walls. Else its wide cracks are joined
//! and its openings are filled, where their rims close by themselves.
//!
//! In:         rims by shell, with what is covered of each.
//! Out:        fates of sheets, and fills in the bins.
//! Memory:     the rims of one shell.

use glam::DVec3;

use crate::bridge::cracks::{Cracks, Strips, join_cracks};
use crate::bridge::fill::{FillKind, FillOptions, RimLoop, fill_loop};
use crate::bridge::loops::{MOST_RIMS, Opening, ShellRim, trace};
use crate::bridge::rims::{NEW, RimEdge, TURNED};
use crate::bridge::shells::{Cover, RimOfShell, Shells};
use crate::bridge::{Added, FilledHole, HoleRule, MendOptions, MendStats};
use crate::octree::points::pack_point;
use crate::octree::{Domain, SnapBox};
use crate::store::{Resources, Spool, StoreError};

/// Share of its shell's area beyond which a flat fill would be no repair.
const WANTED_SHARE: f64 = 0.1;

/// Where a flat fill has more of its shell's area, the shell is a panel: its fill is the shell.
const PANEL_SHARE: f64 = 2.0 / 3.0;

/// A panel lies on a face where so much of its rim does.
const LYING_SHARE: f64 = 0.9;

/// More than this of a rim on another part's face: the two run flush there.
const FLUSH_SHARE: f64 = 0.2;

/// An opening is a window where panes are beside so much of its rim.
const GLAZED_SHARE: f64 = 0.5;

/// Less open rim than this is left to the patch.
const LEAST_OPEN_CELLS: f64 = 4.0;

/// Cells at the border of the grid that fills keep free.
const FREE_CELLS: i64 = 2;

/// Fills are not refined below so many cells where they lie between strips.
const COARSE_CELLS: f64 = 1000.0;

/// Holes that are told of one by one.
const MOST_TOLD: usize = 16;

/// Decides about all shells.
pub fn decide(
    rims: &Spool<RimEdge>,
    shells: &mut Shells,
    options: &MendOptions,
    added: &mut Added,
    stats: &mut MendStats,
    resources: &Resources,
) -> Result<(), StoreError> {
    let Some(by_shell) = shells.take_rims() else { return Ok(()) };
    let mut sorted = by_shell.finish()?;
    let mut next = sorted.next()?;
    let mut numbers: Vec<u32> = Vec::new();
    while let Some(RimOfShell { shell, .. }) = next {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        numbers.clear();
        let mut count = 0;
        while let Some(of_shell) = next
            && of_shell.shell == shell
        {
            if numbers.len() < MOST_RIMS {
                numbers.push(of_shell.rim);
            }
            count += 1;
            next = sorted.next()?;
        }
        if count > MOST_RIMS as u64 {
            stats.crowded_rims += count;
            continue;
        }
        let rims = read_rims(rims, &numbers, shells)?;
        let cell = shells.domain.cell_size();
        let room = shells.domain.room(FREE_CELLS);
        Decision { rims: &rims, options, stats, cell, room }.make(shells, added)?;
    }
    Ok(())
}

fn read_rims(
    rims: &Spool<RimEdge>,
    numbers: &[u32],
    shells: &mut Shells,
) -> Result<Vec<ShellRim>, StoreError> {
    let mut of_shell = Vec::with_capacity(numbers.len());
    let mut edges = Vec::new();
    for &number in numbers {
        edges.clear();
        rims.read(number.into(), 1, &mut edges)?;
        let (edge, cover) = (edges[0], shells.cover(number)?);
        let packed = |i: usize| pack_point(on_lattice(edge.corners[i], shells.domain));
        of_shell.push(ShellRim { edge, ends: [packed(0), packed(1)], cover });
    }
    Ok(of_shell)
}

fn on_lattice(corner: [f64; 3], domain: &Domain) -> [u32; 3] {
    domain.snap(corner).map(|c| c as u32)
}

/// A decision about one shell.
struct Decision<'d> {
    rims: &'d [ShellRim],
    options: &'d MendOptions,
    stats: &'d mut MendStats,
    /// Side of a cell.
    cell: f64,
    /// Fills stay in it.
    room: SnapBox,
}

impl Decision<'_> {
    fn make(&mut self, shells: &mut Shells, added: &mut Added) -> Result<(), StoreError> {
        let open_length: f64 = self.rims.iter().map(ShellRim::open_length).sum();
        let least = (LEAST_OPEN_CELLS * self.cell).max(2.0 * self.options.max_gap);
        if open_length >= least {
            self.stats.open_shells += 1;
            if self.wall(shells)? {
                return Ok(());
            }
        }
        // What is wanted stayed open above, so all that is left may be closed.
        match join_cracks(self.rims, self.options.max_gap, shells.domain) {
            Cracks::Joined(strips) => return self.close_cracks(&strips, added),
            Cracks::TooLong(length) => self.stats.patched_length += length,
            Cracks::Narrow => {}
        }
        if open_length >= least { self.close_all(added) } else { Ok(()) }
    }

    /// Makes a wall of the shell if one of its openings is wanted.
    fn wall(&mut self, shells: &mut Shells) -> Result<bool, StoreError> {
        let mut sheets: Vec<u32> = self.rims.iter().map(|rim| rim.edge.sheet).collect();
        sheets.sort_unstable();
        sheets.dedup();
        let shell = shells.together(&sheets)?;
        let openings = trace(self.rims);
        let wanted: Vec<&Opening> =
            openings.iter().filter(|opening| self.is_wanted(opening, shell.area)).collect();
        if wanted.is_empty() && !self.is_held_panel(&sheets, shell.area) {
            return Ok(false);
        }
        self.stats.walled_shells += 1;
        self.stats.walled_triangles += shell.triangles;
        self.stats.walled_area += shell.area;
        self.stats.wanted_openings += wanted.len() as u64;
        let is_free = wanted.iter().all(|opening| opening.held(self.rims)[0] < 0.5);
        shells.wall(&sheets, is_free, self.rims[0].edge.source)?;
        Ok(true)
    }

    /// Puts strips into cracks, and closes what they leave.
    fn close_cracks(&mut self, strips: &Strips, added: &mut Added) -> Result<(), StoreError> {
        self.stats.joined_length += strips.length;
        let like = self.rims[0].edge.like();
        for triangle in &strips.triangles {
            added.push(triangle.map(|corner| corner.to_array()), like)?;
        }
        let Self { options, cell, room, .. } = *self;
        let rims = &strips.rims;
        Decision { rims, options, stats: &mut *self.stats, cell, room }.close_all(added)
    }

    fn close_all(&mut self, added: &mut Added) -> Result<(), StoreError> {
        trace(self.rims).iter().try_for_each(|opening| self.close(opening, added))
    }

    fn is_wanted(&self, opening: &Opening, area: f64) -> bool {
        let share = opening.area(self.rims) / area;
        let [_, lying] = opening.held(self.rims);
        match self.options.holes {
            // A panel that lies on a face is a part of it, as a decal is; a pane may as well be set
            // into a frame that it is flush with.
            _ if share > PANEL_SHARE => lying < LYING_SHARE || self.rims[0].edge.is_pane(),
            HoleRule::All => false,
            // One looks through it at the inside, or it is a pane itself.
            HoleRule::Auto if self.is_looked_through(opening) => true,
            // Cut open by a part that runs flush with it, it is no vessel: parts unite.
            HoleRule::Auto if lying > FLUSH_SHARE && lying < LYING_SHARE => false,
            HoleRule::Auto => share > WANTED_SHARE,
            HoleRule::UpTo(size) => {
                let [lo, hi] = bounds(&opening.points(self.rims));
                lo.distance(hi) > size
            }
        }
    }

    fn is_looked_through(&self, opening: &Opening) -> bool {
        opening.glazed(self.rims) > GLAZED_SHARE || self.rims[0].edge.is_pane()
    }

    /// Whether the shell is one sheet, held by a part of its rim, that a fill of the whole rim
    /// would only double.
    fn is_held_panel(&self, sheets: &[u32], area: f64) -> bool {
        if sheets.len() > 1 {
            return false;
        }
        let bare: Vec<ShellRim> =
            self.rims.iter().map(|rim| ShellRim { cover: Cover::default(), ..*rim }).collect();
        let lying: f64 = self.rims.iter().map(|r| r.cover.lying * r.edge.length()).sum();
        let length: f64 = self.rims.iter().map(|rim| rim.edge.length()).sum();
        let whole: f64 = trace(&bare).iter().map(|opening| opening.area(&bare)).sum();
        whole > PANEL_SHARE * area && lying < LYING_SHARE * length
    }

    /// Fills an opening if its rim closes by itself.
    fn close(&mut self, opening: &Opening, added: &mut Added) -> Result<(), StoreError> {
        let [held, _] = opening.held(self.rims);
        if opening.widest_jump > 0.0 || opening.steps.len() < 3 || held > 0.5 {
            self.stats.patched_length += self.length(opening);
            return Ok(());
        }
        let rim = RimLoop { points: opening.points(self.rims), opposite: self.opposite(opening) };
        // What is left between strips is as small as they are: it needs no finer triangles.
        let is_new = opening.steps.iter().any(|step| self.rims[step.rim].edge.flags & NEW != 0);
        let cell = if is_new { COARSE_CELLS * self.cell } else { self.cell };
        let options = FillOptions { cell, crease_deg: self.options.crease_deg };
        let Some(fill) = fill_loop(&rim, &options) else {
            self.stats.patched_length += self.length(opening);
            return Ok(());
        };
        let first = opening.steps[0];
        let edge = &self.rims[first.rim].edge;
        // A sheet runs along its rim one way, what closes it the other.
        let is_turned = first.backward == (edge.flags & TURNED == 0);
        let (lo, hi) = (DVec3::from(self.room.lo), DVec3::from(self.room.hi));
        let mut area = 0.0;
        for corners in fill.triangles {
            let [p, q, r] = corners.map(|corner| corner.clamp(lo, hi));
            area += 0.5 * (q - p).cross(r - p).length();
            let corners = if is_turned { [p, q, r] } else { [q, p, r] };
            added.push(corners.map(|p| p.to_array()), edge.like())?;
        }
        // What is left between strips is no hole.
        if !is_new {
            self.tell(&rim.points, area, fill.kind);
        }
        Ok(())
    }

    /// The third corners of the triangles along an opening.
    fn opposite(&self, opening: &Opening) -> Vec<Option<DVec3>> {
        let edges = opening.steps.iter().map(|step| &self.rims[step.rim].edge);
        edges.map(|edge| (edge.flags & NEW == 0).then(|| edge.opposite())).collect()
    }

    /// Length of an opening that no rim faces.
    fn length(&self, opening: &Opening) -> f64 {
        opening.steps.iter().map(|step| self.rims[step.rim].open_length()).sum()
    }

    fn tell(&mut self, points: &[DVec3], area: f64, kind: FillKind) {
        self.stats.filled_holes += 1;
        self.stats.smooth_holes += u64::from(kind == FillKind::Smooth);
        self.stats.filled_area += area;
        let [lo, hi] = bounds(points).map(|p| p.to_array());
        let holes = &mut self.stats.widest_holes;
        holes.push(FilledHole { lo, hi, area, edges: points.len() as u64 });
        holes.sort_by(|a, b| b.area.total_cmp(&a.area));
        holes.truncate(MOST_TOLD);
    }
}

fn bounds(points: &[DVec3]) -> [DVec3; 2] {
    let lo = points.iter().fold(DVec3::INFINITY, |lo, p| lo.min(*p));
    [lo, points.iter().fold(DVec3::NEG_INFINITY, |hi, p| hi.max(*p))]
}
