//! The value that a share of many is not above, exactly, out of core.

use bytemuck::{Pod, Zeroable};

use crate::store::{Record, Sorter, StoreError};

/// A number that is not negative: its bits have its order.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Value(u64);

impl Value {
    pub(crate) fn new(x: f64) -> Self {
        // There is no negative zero to be told from zero.
        Self((x + 0.0).to_bits())
    }
}

impl Record for Value {
    type Key = u64;
    fn key(&self) -> u64 {
        self.0
    }
}

/// For each of `shares`, which ascend, the least of `count` values that no fewer are not above; 0 of
/// none.
pub(crate) fn quantiles<const N: usize>(
    values: Sorter<Value>,
    count: u64,
    shares: [f64; N],
) -> Result<[f64; N], StoreError> {
    let mut sorted = values.finish()?;
    let mut taken = 0;
    let mut last = 0.0;
    let mut found = [0.0; N];
    for (share, found) in shares.into_iter().zip(&mut found) {
        let rank = (share * count as f64).ceil() as u64;
        while taken < rank
            && let Some(Value(bits)) = sorted.next()?
        {
            last = f64::from_bits(bits);
            taken += 1;
        }
        *found = last;
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Scratch;

    #[test]
    fn quantiles_are_values_by_rank() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut sorter = Sorter::new(&Scratch::new(folder.path()), 16 << 10);
        for i in 0..10_000_u32 {
            sorter.push(Value::new(f64::from(i * 7919 % 10_000))).expect("the scratch disk works");
        }
        let found = quantiles(sorter, 10_000, [0.5, 0.99, 0.999, 1.0]);
        assert_eq!(found.expect("the scratch disk works"), [4999.0, 9899.0, 9989.0, 9999.0]);
    }
}
