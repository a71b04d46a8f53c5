//! Bodies: which triangles are judged together.
//!
//! In:         the soup in bins.
//! Out:        [`Bodies`].
//! Invariant:  a triangle that stands for another is of the body of that one; open bodies of one
//!             part are one.
//! Memory:     5 bytes a triangle, in tables that spill.

use bytemuck::{Pod, Zeroable};

use crate::octree::points::is_owned;
use crate::octree::{BinnedSoup, BorderUse, Domain, Panes, SoupEdges, SoupTriangle};
use crate::store::{Labels, Record, Resources, Sorter, StoreError, Table, Unite};

/// An open body and its part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct OpenOfPart {
    part: u32,
    body: u32,
}

impl Record for OpenOfPart {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.part, self.body)
    }
}

/// See the module.
pub struct Bodies {
    labels: Labels,
}

impl Bodies {
    /// Joins the triangles of a soup with source numbers below `triangles`.
    ///
    /// # Errors
    /// The scratch disk fails, the caller cancels, or there are too many triangles to number.
    pub fn join(
        soup: &BinnedSoup,
        triangles: u64,
        domain: &Domain,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let share_bytes = resources.share_bytes / 8;
        let SoupEdges { pairs, borders } = SoupEdges::find(soup, domain, Panes::Joined, resources)?;
        let mut bodies = Unite::new(resources.scratch, share_bytes, triangles)?;
        let mut sorted = pairs.finish()?;
        while let Some(pair) = sorted.next()? {
            bodies.unite(pair.one, pair.other)?;
        }
        let open = join_borders(borders, triangles, &mut bodies, resources)?;
        each_triangle(soup, domain, resources, |triangle| {
            match triangle.stands_for.checked_sub(1) {
                Some(other) => bodies.unite(triangle.source, other),
                None => Ok(()),
            }
        })?;
        join_open(soup, open, domain, &mut bodies, resources)?;
        Ok(Self { labels: bodies.finish()? })
    }

    /// The body of a triangle: the smallest source number that it has.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn of(&mut self, source: u32) -> Result<u32, StoreError> {
        self.labels.label(source)
    }

    /// How many source numbers there are.
    pub(super) fn triangles(&self) -> u64 {
        self.labels.len()
    }
}

/// Joins what meets at edges of one triangle or more than two; of every triangle 1 where it is at
/// an edge with an odd number of them.
fn join_borders(
    borders: Sorter<BorderUse>,
    triangles: u64,
    bodies: &mut Unite,
    resources: &Resources,
) -> Result<Table<u8>, StoreError> {
    let mut open = Table::new(resources.scratch, resources.share_bytes / 16);
    for _ in 0..triangles {
        open.push(0)?;
    }
    let mut sorted = borders.finish()?;
    let mut next = sorted.next()?;
    while let Some(first) = next {
        let mut is_odd = false;
        while let Some(border) = next
            && border.ends == first.ends
        {
            bodies.unite(first.source, border.source)?;
            is_odd = !is_odd;
            next = sorted.next()?;
        }
        if is_odd {
            open.set(first.source.into(), 1)?;
        }
    }
    Ok(open)
}

/// Joins the open bodies of each part.
fn join_open(
    soup: &BinnedSoup,
    mut open: Table<u8>,
    domain: &Domain,
    bodies: &mut Unite,
    resources: &Resources,
) -> Result<(), StoreError> {
    for source in 0..open.len() {
        if open.get(source)? == 1 {
            open.set(bodies.find(source as u32)?.into(), 1)?;
        }
    }
    let mut of_part = Sorter::new(resources.scratch, resources.share_bytes / 8);
    each_triangle(soup, domain, resources, |triangle| {
        let body = bodies.find(triangle.source)?;
        if open.get(body.into())? == 1 {
            of_part.push(OpenOfPart { part: triangle.part, body })?;
        }
        Ok(())
    })?;
    let mut sorted = of_part.finish()?;
    let mut last: Option<OpenOfPart> = None;
    while let Some(next) = sorted.next()? {
        if let Some(last) = last.filter(|last| last.part == next.part) {
            bodies.unite(last.body, next.body)?;
        }
        last = Some(next);
    }
    Ok(())
}

/// Visits every triangle of a soup once.
pub(super) fn each_triangle(
    soup: &BinnedSoup,
    domain: &Domain,
    resources: &Resources,
    mut visit: impl FnMut(&SoupTriangle) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut walk = soup.walk();
    while let Some(bin) = walk.next_bin()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        bin.each(soup, |triangle| match is_owned(triangle, domain, bin.brick.0) {
            true => visit(triangle),
            false => Ok(()),
        })?;
    }
    Ok(())
}
