//! Triangle strips: each index after the second closes a triangle, -1 starts a new strip.

use crate::io::polygon::checked_index;

/// What one more index of a strip gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Not enough corners yet.
    Nothing,
    /// A triangle, turned like the first of its strip.
    Triangle([u32; 3]),
    /// A triangle with a corner that does not exist.
    Wild,
}

/// The state of a strip that is being read.
#[derive(Debug, Default)]
pub(crate) struct Strip {
    /// Indices of this list that are still in the file.
    pub(crate) left: u64,
    seen: u64,
    last: [Option<u32>; 2],
}

impl Strip {
    /// A list of `count` indices begins.
    pub(crate) fn start(count: u64) -> Self {
        Self { left: count, ..Self::default() }
    }

    /// Takes the next index, of `vertices`.
    pub(crate) fn step(&mut self, index: f64, vertices: u64) -> Step {
        self.left -= 1;
        if index == -1.0 {
            self.seen = 0;
            return Step::Nothing;
        }
        let vertex = checked_index(index, vertices);
        let [a, b] = self.last;
        self.last = [b, vertex];
        self.seen += 1;
        if self.seen < 3 {
            return Step::Nothing;
        }
        match (a, b, vertex) {
            (Some(a), Some(b), Some(c)) if self.seen % 2 == 1 => Step::Triangle([a, b, c]),
            (Some(a), Some(b), Some(c)) => Step::Triangle([b, a, c]),
            _ => Step::Wild,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_one_way_and_start_again_after_minus_one() {
        let mut strip = Strip::start(9);
        let indices = [0.0, 1.0, 2.0, 3.0, -1.0, 3.0, 2.0, 1.0, 7.0];
        let steps: Vec<_> = indices
            .iter()
            .map(|&index| strip.step(index, 4))
            .filter(|step| *step != Step::Nothing)
            .collect();
        let expected = [[0, 1, 2], [2, 1, 3], [3, 2, 1]].map(Step::Triangle);
        assert_eq!(steps[..3], expected);
        assert_eq!(steps[3..], [Step::Wild]);
        assert_eq!(strip.left, 0);
    }
}
