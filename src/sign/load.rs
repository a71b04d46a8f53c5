//! Loads a brick with its flips: marks and barrier as bit planes.

use crate::octree::{
    BrickKey, EdgeBits, EdgeWalk, FlipReader, FlipRecord, Flips, HitEdge, decode_hits,
};
use crate::sign::SignError;
use crate::store::{BrickFile, Resources, StoreError, View};

/// A brick to be looked at: its hits, its flips, or both.
pub struct LoadItem {
    /// The brick.
    pub brick: BrickKey,
    /// Its number in the file of hits.
    pub hits: Option<usize>,
    /// Its flipped edges, ascending.
    pub flips: Vec<FlipRecord>,
}

/// What a byte of a record of hits takes while the brick is looked at, with what comes of it.
const RECORD_FACTOR: u64 = 2;

impl LoadItem {
    /// About how much memory the brick takes.
    pub fn weight_bytes(&self, hits: &BrickFile) -> u64 {
        let record = self.hits.map_or(0, |number| hits.record_bytes(number));
        RECORD_FACTOR * record + 2 * size_of_val(&*self.flips) as u64
    }
}

/// Bricks with hits or flips, in Morton order.
pub struct LoadItems<'f> {
    hits: &'f BrickFile,
    next: usize,
    flips: FlipReader<'f>,
    resources: Resources<'f>,
}

impl<'f> LoadItems<'f> {
    pub fn new(hits: &'f BrickFile, flips: &'f Flips, resources: &Resources<'f>) -> Self {
        Self { hits, next: 0, flips: flips.by_brick(), resources: *resources }
    }

    /// The next brick.
    pub fn next(&mut self) -> Result<Option<LoadItem>, StoreError> {
        if self.resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        let hit = self.hits.directory().get(self.next).map(|entry| entry.key);
        let flip = self.flips.peek_brick()?;
        let Some(key) = hit.into_iter().chain(flip).min() else { return Ok(None) };
        let number = (hit == Some(key)).then_some(self.next);
        self.next += usize::from(number.is_some());
        let flips = self.flips.take(key)?;
        Ok(Some(LoadItem { brick: BrickKey(key), hits: number, flips }))
    }
}

/// The bit planes of a loaded brick.
#[derive(Default)]
pub struct Loaded {
    /// Edges whose two ends differ by parity, after the flips.
    pub marks: EdgeBits,
    /// Edges that have a hit or that a patch crosses.
    pub barrier: EdgeBits,
}

impl Loaded {
    /// As [`Self::load`]; checks that no face is odd.
    pub fn load_checked(
        &mut self,
        hits: &BrickFile,
        item: &LoadItem,
    ) -> Result<Option<View>, SignError> {
        let view = self.load(hits, item)?;
        if !self.marks.is_closed() {
            let expected = "no odd face after patching";
            return Err(SignError::Contradiction { brick: item.brick.position(), expected });
        }
        Ok(view)
    }

    /// Fills the planes; hands back the record of hits.
    pub fn load(&mut self, hits: &BrickFile, item: &LoadItem) -> Result<Option<View>, SignError> {
        self.marks.clear();
        self.barrier.clear();
        let view = item.hits.map(|number| hits.view(number)).transpose()?;
        if let Some(view) = &view {
            let mut walk = EdgeWalk::default();
            for edge in decode_hits(view)?.edges.iter() {
                let edge = HitEdge::from(edge);
                walk.go_to(edge.edge());
                let (_, [x, _, _]) = walk.position();
                self.barrier.set_in_row(walk.row(), x);
                if edge.class() & 1 == 1 {
                    self.marks.set_in_row(walk.row(), x);
                }
            }
        }
        for flip in &item.flips {
            self.marks.toggle(flip.edge);
            self.barrier.set(flip.edge);
        }
        Ok(view)
    }
}
