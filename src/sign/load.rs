//! Loads a brick with its flips: marks and barrier as bit planes.

use crate::octree::{
    BrickKey, EdgeBits, FlipReader, FlipRecord, Flips, HitEdge, SIDE, decode_hits, edge_index,
    edge_position,
};
use crate::sign::SignError;
use crate::sign::sheets::{SheetReader, Sheets};
use crate::store::{BrickFile, Resources, StoreError, View};

/// A brick to be looked at: its hits, its flips, or both.
pub struct LoadItem {
    /// The brick.
    pub brick: BrickKey,
    /// Its number in the file of hits.
    pub hits: Option<usize>,
    /// Its flipped edges, ascending.
    pub flips: Vec<FlipRecord>,
    /// Corners behind sheets, ascending.
    pub sheet_corners: Vec<u32>,
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

/// Bricks with hits, flips or corners behind sheets, in Morton order.
pub struct LoadItems<'f> {
    hits: &'f BrickFile,
    next: usize,
    flips: FlipReader<'f>,
    sheets: Option<SheetReader<'f>>,
    resources: Resources<'f>,
}

impl<'f> LoadItems<'f> {
    pub fn new(
        hits: &'f BrickFile,
        flips: &'f Flips,
        sheets: Option<&'f Sheets>,
        resources: &Resources<'f>,
    ) -> Self {
        let sheets = sheets.map(Sheets::by_brick);
        Self { hits, next: 0, flips: flips.by_brick(), sheets, resources: *resources }
    }

    /// The next brick.
    pub fn next(&mut self) -> Result<Option<LoadItem>, StoreError> {
        if self.resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        let hit = self.hits.directory().get(self.next).map(|entry| entry.key);
        let flip = self.flips.peek_brick()?;
        let sheet = self.sheets.as_mut().map_or(Ok(None), SheetReader::peek_brick)?;
        let Some(key) = hit.into_iter().chain(flip).chain(sheet).min() else { return Ok(None) };
        let number = (hit == Some(key)).then_some(self.next);
        self.next += usize::from(number.is_some());
        let flips = self.flips.take(key)?;
        let sheet_corners = self.sheets.as_mut().map_or(Ok(Vec::new()), |s| s.take(key))?;
        Ok(Some(LoadItem { brick: BrickKey(key), hits: number, flips, sheet_corners }))
    }
}

/// The bit planes of a loaded brick.
#[derive(Default)]
pub struct Loaded {
    /// Edges whose two ends differ by parity, after the flips.
    pub marks: EdgeBits,
    /// Edges that have a hit or that a patch crosses.
    pub barrier: EdgeBits,
    /// Odd edges that a patch flipped back, and whether the triangles there face up the axis.
    pub sheet_edges: Vec<(u32, bool)>,
}

impl Loaded {
    /// Fills the planes; hands back the record of hits.
    pub fn load(&mut self, hits: &BrickFile, item: &LoadItem) -> Result<Option<View>, SignError> {
        self.marks.clear();
        self.barrier.clear();
        self.sheet_edges.clear();
        let view = item.hits.map(|number| hits.view(number)).transpose()?;
        if let Some(view) = &view {
            for edge in decode_hits(view)?.edges.iter() {
                let edge = HitEdge { bits: edge.bits.to_native(), signed_sum: 0 };
                self.barrier.set(edge.edge());
                if edge.class() & 1 == 1 {
                    self.marks.set(edge.edge());
                }
            }
        }
        if let Some(view) = &view {
            self.find_sheet_edges(view, &item.flips)?;
        }
        for flip in &item.flips {
            self.marks.toggle(flip.edge);
            self.barrier.set(flip.edge);
        }
        for &corner in &item.sheet_corners {
            self.close_around(corner);
        }
        if !self.marks.is_closed() {
            let expected = "no odd face after patching";
            return Err(SignError::Contradiction { brick: item.brick.position(), expected });
        }
        Ok(view)
    }

    /// Nothing passes a corner behind a sheet: it is a region of its own, and inside.
    fn close_around(&mut self, corner: u32) {
        let (_, at) = edge_position(corner);
        for axis in 0..3 {
            if at[axis] < SIDE {
                self.barrier.set(edge_index(axis, at));
            }
            if at[axis] > 0 {
                let mut below = at;
                below[axis] -= 1;
                self.barrier.set(edge_index(axis, below));
            }
        }
    }

    /// Before the flips are applied: which of them fall on odd edges, but for those at cracks.
    fn find_sheet_edges(&mut self, view: &View, flips: &[FlipRecord]) -> Result<(), SignError> {
        let of_sheet = |flip: &&FlipRecord| flip.at_crack == 0 && self.marks.get(flip.edge);
        let mut flips = flips.iter().filter(of_sheet).peekable();
        if flips.peek().is_none() {
            return Ok(());
        }
        for edge in decode_hits(view)?.edges.iter() {
            let signed_sum = edge.signed_sum.to_native();
            let edge = HitEdge { bits: edge.bits.to_native(), signed_sum };
            while flips.next_if(|flip| flip.edge < edge.edge()).is_some() {}
            if flips.next_if(|flip| flip.edge == edge.edge()).is_some() {
                self.sheet_edges.push((edge.edge(), signed_sum > 0));
            }
        }
        Ok(())
    }
}
