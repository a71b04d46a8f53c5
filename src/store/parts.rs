//! A union of few things, in memory: what hangs together around a vertex or in a face.
//!
//! Memory: one number for each thing.

/// Things, each in a part that is known by its first.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    parents: Vec<usize>,
}

impl Parts {
    /// So many things, each by itself.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self { parents: (0..count).collect() }
    }

    /// The same anew, in the room that is there.
    pub fn reset(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend(0..count);
    }

    /// The first thing of the part that `thing` belongs to; the way there gets shorter.
    pub fn first(&mut self, mut thing: usize) -> usize {
        while self.parents[thing] != thing {
            self.parents[thing] = self.parents[self.parents[thing]];
            thing = self.parents[thing];
        }
        thing
    }

    /// Joins the parts of two things; whether they were two.
    pub fn unite(&mut self, one: usize, other: usize) -> bool {
        let (a, b) = (self.first(one), self.first(other));
        self.parents[a.max(b)] = a.min(b);
        a != b
    }

    /// Of every thing the first of its part.
    pub fn firsts(&mut self) -> &[usize] {
        // Parents come before, so theirs are final already.
        for thing in 0..self.parents.len() {
            self.parents[thing] = self.parents[self.parents[thing]];
        }
        &self.parents
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_known_by_their_first() {
        let mut parts = Parts::new(6);
        assert!(parts.unite(5, 3) && parts.unite(3, 1) && !parts.unite(1, 5));
        assert!(parts.unite(2, 4));
        assert_eq!(parts.first(5), 1);
        assert_eq!(parts.firsts(), [0, 1, 2, 1, 2, 1]);
        parts.reset(2);
        assert_eq!(parts.firsts(), [0, 1]);
    }
}
