//! Names of bricks.

use crate::geom::morton;

/// The place of a brick in the grid of bricks, packed in Morton order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BrickKey(pub u64);

impl BrickKey {
    /// The brick at these brick coordinates.
    #[must_use]
    pub const fn new(position: [u32; 3]) -> Self {
        Self(morton::encode(position))
    }

    /// Its brick coordinates.
    #[must_use]
    pub const fn position(self) -> [u32; 3] {
        morton::decode(self.0)
    }

    /// The brick one step down along the axes set in `axes` (bit 0 = x); `None` outside the grid.
    #[must_use]
    pub fn lower(self, axes: u32) -> Option<Self> {
        let mut position = self.position();
        for (axis, coordinate) in position.iter_mut().enumerate() {
            if axes >> axis & 1 == 1 {
                *coordinate = coordinate.checked_sub(1)?;
            }
        }
        Some(Self::new(position))
    }

    /// The brick one step up along `axis`; the caller knows where the grid ends.
    #[must_use]
    pub fn upper(self, axis: usize) -> Self {
        let mut position = self.position();
        position[axis] += 1;
        Self::new(position)
    }
}
