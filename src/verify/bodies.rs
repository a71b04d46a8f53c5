//! Components that grow together while triangles pass by, and end with their last vertex.
//!
//! In:         joins, volumes of cones, and how many vertices refer to a body.
//! Out:        the number of finished components, and whether all of them surely face outward.
//! Invariant:  a body that nothing refers to is given back; a root among those is a component all
//!             of whose vertices are closed.
//! Memory:     64 bytes for each body at one time.
//! Source:     Tarjan 1975 (union by size).

use crate::verify::cone::{CONE_BOUND, Compensated, Cone, LEAST_VOLUME};

/// The number of a body.
pub(crate) type BodyId = u32;

#[derive(Clone, Copy, Default)]
struct Body {
    /// Itself, for a root.
    parent: BodyId,
    /// Vertices and bodies that refer to it.
    references: u32,
    triangles: u64,
    volume: Compensated,
    magnitude: f64,
}

/// All bodies that are not finished.
#[derive(Default)]
pub(crate) struct Bodies {
    bodies: Vec<Body>,
    free: Vec<BodyId>,
    finished: u64,
    doubtful: u64,
}

impl Bodies {
    /// Bytes per body.
    pub(crate) const BODY_BYTES: u64 = (size_of::<Body>() + size_of::<BodyId>()) as u64;

    /// Components that came to an end.
    pub(crate) fn finished(&self) -> u64 {
        self.finished
    }

    /// Those among them whose volume is not surely positive.
    pub(crate) fn doubtful(&self) -> u64 {
        self.doubtful
    }

    /// The most bodies that there were at one time.
    pub(crate) fn peak(&self) -> u64 {
        self.bodies.len() as u64
    }

    /// A new body, which nothing refers to yet.
    pub(crate) fn begin(&mut self) -> BodyId {
        let id = self.free.pop().unwrap_or(self.bodies.len() as BodyId);
        let body = Body { parent: id, ..Body::default() };
        if id as usize == self.bodies.len() {
            self.bodies.push(body);
        } else {
            self.bodies[id as usize] = body;
        }
        id
    }

    /// The body that `id` has become part of.
    #[inline]
    pub(crate) fn root(&self, mut id: BodyId) -> BodyId {
        while self.bodies[id as usize].parent != id {
            id = self.bodies[id as usize].parent;
        }
        id
    }

    /// One more reference.
    #[inline]
    pub(crate) fn refer(&mut self, id: BodyId) {
        self.bodies[id as usize].references += 1;
    }

    /// One reference less; a root without any is a finished component.
    #[inline]
    pub(crate) fn release(&mut self, mut id: BodyId) {
        loop {
            let body = &mut self.bodies[id as usize];
            body.references -= 1;
            if body.references > 0 {
                return;
            }
            self.free.push(id);
            if body.parent == id {
                let volume = body.volume.value();
                let least = (CONE_BOUND * body.magnitude).max(LEAST_VOLUME);
                self.finished += 1;
                // Written so that a NaN is doubtful too.
                self.doubtful += u64::from(!(volume > least && volume.is_finite()));
                return;
            }
            id = body.parent;
        }
    }

    /// Makes two roots one and tells which.
    pub(crate) fn join(&mut self, a: BodyId, b: BodyId) -> BodyId {
        if a == b {
            return a;
        }
        let smaller = self.bodies[a as usize].triangles < self.bodies[b as usize].triangles;
        let (root, part) = if smaller { (b, a) } else { (a, b) };
        let Body { triangles, volume, magnitude, .. } = self.bodies[part as usize];
        self.bodies[part as usize].parent = root;
        let body = &mut self.bodies[root as usize];
        body.references += 1;
        body.triangles += triangles;
        body.volume.join(volume);
        body.magnitude += magnitude;
        root
    }

    /// Adds a triangle to a root.
    #[inline]
    pub(crate) fn add(&mut self, root: BodyId, cone: &Cone) {
        let body = &mut self.bodies[root as usize];
        body.triangles += 1;
        body.volume.add(cone.volume);
        body.magnitude += cone.magnitude;
    }
}
