//! The parity of every brick's min corner, from the marks on the lines between brick corners.

use crate::octree::BrickKey;
use crate::sign::graph::GraphBrick;

/// For each brick, whether its min corner is inside by parity.
///
/// Along the line through the min corners of a row of bricks, every mark lies on the first x line
/// of a brick that exists; the line starts outside.
pub fn base_parities(bricks: &[GraphBrick]) -> Vec<bool> {
    let mut order: Vec<([u32; 3], u32)> = bricks
        .iter()
        .enumerate()
        .map(|(number, brick)| {
            let [x, y, z] = BrickKey(brick.key).position();
            ([z, y, x], number as u32)
        })
        .collect();
    order.sort_unstable();
    let mut inside = vec![false; bricks.len()];
    let mut row = None;
    let mut parity = false;
    for ([z, y, _], number) in order {
        if row != Some([z, y]) {
            row = Some([z, y]);
            parity = false;
        }
        inside[number as usize] = parity;
        parity ^= bricks[number as usize].odd_first_line;
    }
    inside
}
