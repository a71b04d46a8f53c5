//! The fill of a loop while it is made: its corners, its parts between creases, its triangles.

use glam::DVec3;

use crate::bridge::fill::coarse::cut_coarse;
use crate::bridge::fill::crease::{Angles, Creases, find_creases};
use crate::bridge::fill::flat::{cut_flat, zip};
use crate::bridge::fill::outline::{Outline, rim_normals};
use crate::bridge::fill::refine::refine;
use crate::bridge::fill::surface::Surface;
use crate::bridge::fill::{Fill, FillKind, FillOptions, LONGEST_LOOP, MOST_TRIANGLES, RimLoop};

/// A loop that leaves its plane by less is in a plane, in cells ...
pub const FLAT_CELLS: f64 = 0.25;
/// ... if it is also less than this part of its diameter.
const FLAT_SHARE: f64 = 0.01;
/// A loop narrower than this is a line, in cells ...
const LINE_CELLS: f64 = 0.1;
/// ... and so is one narrower than this part of its diameter: a rounded T-junction.
const LINE_SHARE: f64 = 1e-6;
/// A loop of less than this many cells in diameter is not refined.
const COARSE_CELLS: f64 = 2.0;
/// A surface that goes on in a fill leans by less than 70 degrees: walls around an opening end.
const WALL_COSINE: f64 = 0.342;
/// Share of a rim in a plane that leans evenly if a dome is missing, and not a lid or a panel.
const DOME_SHARE: f64 = 0.9;
/// The rim of a dome turns by less than 50 degrees at every corner, that of a frustum does not.
const DOME_TURN_COSINE: f64 = 0.643;
/// A fill stays this close to the coarse one, in diameters of the loop.
const STRAY_SHARE: f64 = 0.5;

/// Corners of a loop, by number, with what is behind its edges.
pub struct Part {
    pub corners: Vec<u32>,
    pub opposite: Vec<Option<DVec3>>,
}

impl Part {
    /// The loop itself.
    pub fn whole(rim: &RimLoop) -> Self {
        let origin = rim.points[0];
        let opposite = rim
            .opposite
            .iter()
            .map(|corner| corner.filter(|corner| corner.is_finite()).map(|corner| corner - origin));
        Self { corners: (0..rim.points.len() as u32).collect(), opposite: opposite.collect() }
    }
}

/// All corners and triangles so far.
pub struct Fills<'a> {
    rim: &'a RimLoop,
    pub angles: Angles,
    pub cell: f64,
    /// Relative to the first corner of the rim, whose corners come first.
    places: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    kind: FillKind,
    creases: u32,
}

impl<'a> Fills<'a> {
    pub fn new(rim: &'a RimLoop, options: &FillOptions) -> Self {
        Self {
            rim,
            angles: Angles::new(options.crease_deg),
            cell: options.cell,
            places: rim.points.iter().map(|point| point - rim.points[0]).collect(),
            triangles: Vec::new(),
            kind: FillKind::Flat,
            creases: 0,
        }
    }

    /// The same, but that creases are only joined by straight lines.
    pub fn without_arcs(rim: &'a RimLoop, options: &FillOptions) -> Self {
        let mut fills = Self::new(rim, options);
        fills.angles.arcs = false;
        fills
    }

    /// Whether no edge has more than two triangles.
    pub fn is_manifold(&self) -> bool {
        let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
        let mut sides: Vec<[u32; 2]> = self.triangles.iter().flat_map(sides).collect();
        sides.sort_unstable();
        sides.windows(2).all(|pair| pair[0] != pair[1])
    }

    pub fn finish(self) -> Fill {
        let (rim, places) = (&self.rim.points, &self.places);
        let place = |corner: u32| {
            let corner = corner as usize;
            rim.get(corner).copied().unwrap_or_else(|| rim[0] + places[corner])
        };
        let triangles = self.triangles.iter().map(|t| t.map(place)).collect();
        Fill { triangles, kind: self.kind, creases: self.creases }
    }

    /// Fills a part; false for a loop that is too long for it.
    pub fn fill(&mut self, part: Part) -> bool {
        let points: Vec<DVec3> =
            part.corners.iter().map(|&corner| self.places[corner as usize]).collect();
        let outline = Outline::new(&points);
        let line = (LINE_CELLS * self.cell).max(LINE_SHARE * outline.diameter);
        if outline.width <= line {
            self.add(&part, zip(&points, outline.ends), FillKind::Flat);
            return true;
        }
        let normals = rim_normals(&points, &part.opposite);
        let creases = find_creases(&points, &part.opposite, &normals, self.angles, self.cell);
        if let Some(creases) = creases.filter(|_| points.len() <= LONGEST_LOOP) {
            return self.divide(&part, creases);
        }
        if self.is_flat(&points, &normals, &outline) {
            self.add(&part, cut_flat(&points), FillKind::Flat);
        } else if points.len() > LONGEST_LOOP {
            return false;
        } else {
            self.fill_in_space(&part, &points, &normals, &outline);
        }
        true
    }

    /// Fills the parts between creases, each on its own.
    fn divide(&mut self, part: &Part, creases: Creases) -> bool {
        let ends = &creases.ends;
        let first = self.places.len() as u32;
        // A line from end to end counts once.
        self.creases += if creases.apex.is_some() { ends.len() as u32 } else { 1 };
        self.places.extend(creases.apex.into_iter().chain(creases.path));
        let mut between: Vec<u32> = (first..self.places.len() as u32).collect();
        let count = part.corners.len();
        let mut all = true;
        for (i, &from) in ends.iter().enumerate() {
            let to = ends[(i + 1) % ends.len()];
            let edges = (to + count - from) % count;
            let at = |step: usize| (from + step) % count;
            let mut corners: Vec<u32> = (0..=edges).map(|step| part.corners[at(step)]).collect();
            let mut opposite: Vec<_> = (0..edges).map(|step| part.opposite[at(step)]).collect();
            // Back to where this part began: on the first part against the path.
            between.reverse();
            corners.extend(&between);
            opposite.resize(corners.len(), None);
            all &= self.fill(Part { corners, opposite });
        }
        all
    }

    /// Whether the loop is in a plane, and the surface does not arch over it.
    fn is_flat(&self, points: &[DVec3], normals: &[Option<DVec3>], outline: &Outline) -> bool {
        let tolerance = (FLAT_CELLS * self.cell).min(FLAT_SHARE * outline.diameter);
        let rounding = 1e-9 * outline.diameter;
        if outline.deviation > tolerance.max(rounding) {
            return false;
        }
        let tilt = outline.tilt(points, normals);
        // tan(t / 2) = sqrt((1 - cos t) / (1 + cos t)): the height of a dome over its half width.
        let half_tangent = ((1.0 - tilt.mean) / (1.0 + tilt.mean)).max(0.0).sqrt();
        let is_dome = tilt.mean > WALL_COSINE
            && tilt.even >= DOME_SHARE
            && outline.sharpest_turn > DOME_TURN_COSINE
            && half_tangent * outline.diameter / 2.0 > FLAT_CELLS * self.cell;
        !is_dome
    }

    fn fill_in_space(
        &mut self,
        part: &Part,
        points: &[DVec3],
        normals: &[Option<DVec3>],
        outline: &Outline,
    ) {
        let cut = cut_coarse(points, normals);
        if outline.diameter > COARSE_CELLS * self.cell {
            let continues = outline.tilt(points, normals).mean > WALL_COSINE;
            let unknown = vec![None; points.len()];
            let opposite = if continues { &part.opposite } else { &unknown };
            let edge = self.cell.max(outline.mean_edge / 8.0);
            let surface = Surface::through(points, opposite, outline, edge);
            let most = MOST_TRIANGLES.saturating_sub(self.triangles.len());
            let fine =
                surface.and_then(|surface| refine(points, cut.clone(), &surface, edge, most));
            let fine = fine.filter(|fine| {
                let near = STRAY_SHARE * outline.diameter;
                fine.farthest_stray <= near && self.are_apart(&fine.added)
            });
            if let Some(fine) = fine {
                let mut part = Part { corners: part.corners.clone(), opposite: Vec::new() };
                let first = self.places.len() as u32;
                part.corners.extend((first..).take(fine.added.len()));
                self.places.extend(fine.added);
                self.add(&part, fine.triangles, FillKind::Smooth);
                return;
            }
        }
        self.add(part, cut, FillKind::Coarse);
    }

    /// Whether new corners stay apart from each other and all others once they are rounded.
    fn are_apart(&self, added: &[DVec3]) -> bool {
        let bits = |place: DVec3| (place + 0.0).to_array().map(f64::to_bits);
        let origin = self.rim.points[0];
        let new = self.places[self.rim.points.len()..].iter().chain(added);
        let mut all: Vec<_> = new.map(|&place| bits(origin + place)).collect();
        all.extend(self.rim.points.iter().map(|&point| bits(point)));
        all.sort_unstable();
        all.windows(2).all(|pair| pair[0] != pair[1])
    }

    fn add(&mut self, part: &Part, triangles: Vec<[u32; 3]>, kind: FillKind) {
        let named = triangles.into_iter().map(|t| t.map(|corner| part.corners[corner as usize]));
        self.triangles.extend(named);
        self.kind = self.kind.max(kind);
    }
}
