//! Connected components and, for each closed one, which side its volume is on.
//!
//! In:         the tape, and the vertices whose edges are not used alike in both directions.
//! Out:        [`Component`]s with the sign of their volume.
//! Invariant:  signs are exact: f64 sums about a point of the component decide where their error
//!             bound allows, exact sums decide the rest. A sign is asked of a component only if
//!             all its edges are balanced; else its volume means nothing.
//! Memory:     three quarters of `share_bytes`; too many components to hold go through a sort.
//! Fails:      only as [`StoreError`].

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};

use crate::monitor::Monitor;
use crate::store::{Labels, Record, Scratch, Sequence, Sorter, StoreError, Unite};
use crate::verify::cone::{CONE_BOUND, Compensated, Cone, LEAST_VOLUME};
use crate::verify::exact::ExactVolume;
use crate::verify::tape::Tape;

/// Not closed: no volume.
pub(crate) const OPEN: i32 = 2;
/// Closed, but its coordinates differ too much in magnitude for any arithmetic here.
pub(crate) const UNDECIDED: i32 = 3;

/// A connected component.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Component {
    /// Its first point by x, y, z.
    pub(crate) anchor: [f64; 3],
    /// Its first triangle.
    pub(crate) first: u64,
    /// Its smallest vertex.
    pub(crate) label: u32,
    /// The sign of its volume, or [`OPEN`], or [`UNDECIDED`].
    pub(crate) side: i32,
}

/// Unites the vertices of every whole triangle, and counts those.
pub(crate) fn unite(
    tape: &Tape,
    space: u64,
    scratch: &Scratch,
    share_bytes: u64,
    monitor: &dyn Monitor,
) -> Result<(Labels, u64), StoreError> {
    let mut sets = Unite::new(scratch, share_bytes, space)?;
    let mut triangles = 0;
    tape.each_whole(monitor, |[a, b, c]| {
        triangles += 1;
        sets.unite(a, b)?;
        sets.unite(b, c)
    })?;
    Ok((sets.finish()?, triangles))
}

/// A component while its triangles pass by.
#[derive(Clone, Copy)]
struct Body {
    component: Component,
    origin: [f64; 3],
    volume: Compensated,
    magnitude: f64,
}

impl Body {
    fn new(label: u32, first: u64, corners: &[[f64; 3]; 3]) -> Self {
        let anchor = corners[0].map(|x| x + 0.0);
        let component = Component { anchor, first, label, side: UNDECIDED };
        Self { component, origin: anchor, volume: Compensated::default(), magnitude: 0.0 }
    }

    fn add(&mut self, corners: &[[f64; 3]; 3]) {
        let cone = Cone::of(corners, self.origin);
        self.volume.add(cone.volume);
        self.magnitude += cone.magnitude;
        for corner in corners {
            if *corner < self.component.anchor {
                self.component.anchor = corner.map(|x| x + 0.0);
            }
        }
    }

    fn finish(mut self) -> Component {
        let volume = self.volume.value();
        let certain = volume.abs() > (CONE_BOUND * self.magnitude).max(LEAST_VOLUME);
        if self.component.side == UNDECIDED && certain && volume.is_finite() {
            self.component.side = if volume > 0.0 { 1 } else { -1 };
        }
        self.component
    }
}

/// What the measuring of all components needs to know.
pub(crate) struct Measure<'m> {
    pub(crate) tape: &'m Tape,
    pub(crate) labels: &'m mut Labels,
    pub(crate) unbalanced: &'m Sequence<u32>,
    /// The number of components.
    pub(crate) count: u64,
    /// The largest absolute coordinate.
    pub(crate) reach: f64,
    pub(crate) scratch: &'m Scratch,
    pub(crate) share_bytes: u64,
    pub(crate) monitor: &'m dyn Monitor,
}

/// Components whose sign is known, and those that need exact sums.
struct Sorting {
    settled: Sequence<Component>,
    unsettled: Sequence<Component>,
}

impl Sorting {
    fn enter(&mut self, component: Component) -> Result<(), StoreError> {
        let open = component.side == UNDECIDED;
        if open { self.unsettled.push(component) } else { self.settled.push(component) }
    }
}

impl Measure<'_> {
    /// Finds the side of every component.
    pub(crate) fn components(&mut self) -> Result<Sequence<Component>, StoreError> {
        let spool = || Sequence::new(self.scratch, self.share_bytes / 8);
        let mut sorting = Sorting { settled: spool(), unsettled: spool() };
        let body_bytes = (size_of::<Body>() + 48) as u64;
        if self.count <= self.share_bytes / 4 / body_bytes {
            self.sum_in_memory(&mut sorting)?;
        } else {
            self.sum_by_sorting(&mut sorting)?;
        }
        let Sorting { mut settled, unsettled } = sorting;
        self.decide(&unsettled, &mut settled)?;
        Ok(settled)
    }

    fn sum_in_memory(&mut self, sorting: &mut Sorting) -> Result<(), StoreError> {
        let mut bodies: Vec<Body> = Vec::new();
        let mut place_of: HashMap<u32, usize> = HashMap::new();
        let mut last = (u32::MAX, 0);
        let labels = &mut *self.labels;
        self.tape.each(self.monitor, |triangle| {
            if triangle.is_whole() {
                let label = labels.label(triangle.ids[0])?;
                if last.0 != label {
                    let place = *place_of.entry(label).or_insert(bodies.len());
                    if place == bodies.len() {
                        bodies.push(Body::new(label, triangle.number, triangle.corners));
                    }
                    last = (label, place);
                }
                bodies[last.1].add(triangle.corners);
            }
            Ok(true)
        })?;
        self.unbalanced.each_block(1024, |vertices| {
            for &vertex in vertices {
                let label = labels.label(vertex)?;
                bodies[place_of[&label]].component.side = OPEN;
            }
            Ok(())
        })?;
        bodies.into_iter().try_for_each(|body| sorting.enter(body.finish()))
    }

    fn sum_by_sorting(&mut self, sorting: &mut Sorting) -> Result<(), StoreError> {
        let mut sorter = Sorter::new(self.scratch, self.share_bytes / 2);
        let labels = &mut *self.labels;
        self.tape.each(self.monitor, |triangle| {
            if triangle.is_whole() {
                let label = u64::from(labels.label(triangle.ids[0])?);
                let corners = *triangle.corners;
                sorter.push(Labelled { label, triangle: triangle.number, corners })?;
            }
            Ok(true)
        })?;
        self.unbalanced.each_block(64, |vertices| {
            for &vertex in vertices {
                let label = u64::from(labels.label(vertex)?);
                sorter.push(Labelled { label, triangle: OPEN_MARK, corners: [[0.0; 3]; 3] })?;
            }
            Ok(())
        })?;
        let mut sorted = sorter.finish()?;
        let mut body: Option<Body> = None;
        while let Some(Labelled { label, triangle, corners }) = sorted.next()? {
            let label = label as u32;
            let mut current = match body.take() {
                Some(same) if same.component.label == label => same,
                other => {
                    other.map_or(Ok(()), |done| sorting.enter(done.finish()))?;
                    Body::new(label, triangle, &corners)
                }
            };
            if triangle == OPEN_MARK {
                current.component.side = OPEN;
            } else {
                current.add(&corners);
            }
            body = Some(current);
        }
        body.map_or(Ok(()), |done| sorting.enter(done.finish()))
    }

    /// Sums the volumes that f64 could not tell from zero, exactly.
    fn decide(
        &mut self,
        unsettled: &Sequence<Component>,
        settled: &mut Sequence<Component>,
    ) -> Result<(), StoreError> {
        // An expansion holds some forty f64, and its vector may be twice as large.
        let chunk = (self.share_bytes / 8 / 1024).max(1) as usize;
        let scale = scale_for(self.reach);
        let (tape, monitor, labels) = (self.tape, self.monitor, &mut *self.labels);
        unsettled.each_block(chunk, |components| {
            let mut volumes: HashMap<u32, ExactVolume> =
                components.iter().map(|c| (c.label, ExactVolume::new())).collect();
            tape.each(monitor, |triangle| {
                if triangle.is_whole()
                    && let Some(volume) = volumes.get_mut(&labels.label(triangle.ids[0])?)
                {
                    volume.add(&triangle.corners.map(|p| p.map(|x| x * scale)));
                }
                Ok(true)
            })?;
            for component in components {
                let side = volumes[&component.label].sign().unwrap_or(UNDECIDED);
                settled.push(Component { side, ..*component })?;
            }
            Ok(())
        })
    }
}

/// The power of two that brings `reach` below 2, as near as an exponent allows.
fn scale_for(reach: f64) -> f64 {
    let exponent = ((reach.to_bits() >> 52) & 0x7FF).clamp(1, 2045);
    f64::from_bits((2046 - exponent) << 52)
}

/// Sorts behind all triangles.
const OPEN_MARK: u64 = u64::MAX;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Labelled {
    label: u64,
    triangle: u64,
    corners: [[f64; 3]; 3],
}

impl Record for Labelled {
    type Key = (u64, u64);
    fn key(&self) -> Self::Key {
        (self.label, self.triangle)
    }
}
