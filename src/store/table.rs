//! A growing array of fixed records: in memory while it fits its share, in cached blocks on disk
//! beyond. For look-ups by number, such as the vertices of an indexed file.

use bytemuck::Pod;

use crate::store::{Scratch, ScratchFile, StoreError};

/// An array of records, read and written by index.
///
/// Memory: `share_bytes` (at least two blocks of one page), and on disk 4 bytes for each block of
/// 4 to 64 KiB, or of 4 KiB where look-ups are scattered. One user at a time.
pub struct Table<R: Pod> {
    scratch: Scratch,
    share_bytes: usize,
    most_block_bytes: usize,
    len: u64,
    resident: Vec<R>,
    paged: Option<Paged<R>>,
}

struct Paged<R> {
    file: ScratchFile,
    /// A power of two, and its logarithm.
    block_records: usize,
    block_shift: u32,
    slots: Vec<Slot<R>>,
    /// By block; [`NO_SLOT`] for those that are not in memory.
    slot_of_block: Vec<u32>,
    slot_count: usize,
    hand: usize,
    last: (u64, usize),
}

struct Slot<R> {
    block: u64,
    records: Vec<R>,
    dirty: bool,
    used: bool,
}

const LEAST_BLOCK_BYTES: usize = 4 << 10;
const MOST_BLOCK_BYTES: usize = 64 << 10;
const NO_BLOCK: u64 = u64::MAX;
const NO_SLOT: u32 = u32::MAX;

impl<R: Pod> Table<R> {
    /// An empty table that keeps at most `share_bytes` in memory.
    #[must_use]
    pub fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        let share_bytes = usize::try_from(share_bytes).unwrap_or(usize::MAX).max(16 << 10);
        Self {
            scratch: scratch.clone(),
            share_bytes,
            most_block_bytes: MOST_BLOCK_BYTES,
            len: 0,
            resident: Vec::new(),
            paged: None,
        }
    }

    /// As [`Table::new`], for look-ups whose neighbours are of no use.
    #[must_use]
    pub fn scattered(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { most_block_bytes: LEAST_BLOCK_BYTES, ..Self::new(scratch, share_bytes) }
    }

    /// The number of records.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there is no record.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Appends a record.
    ///
    /// # Errors
    /// A block cannot be written or read back.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<(), StoreError> {
        if self.paged.is_none() {
            let most = self.share_bytes / size_of::<R>();
            if self.resident.len() < most {
                if self.resident.len() == self.resident.capacity() {
                    let now = self.resident.capacity();
                    let next = if now * 4 >= most { most } else { (now * 2).max(64).min(most) };
                    self.resident.reserve_exact(next - now);
                }
                self.resident.push(record);
                self.len += 1;
                return Ok(());
            }
            self.page_out()?;
        }
        self.len += 1;
        self.set(self.len - 1, record)
    }

    /// The record at `index`, which is below [`Table::len`].
    ///
    /// # Errors
    /// A block cannot be written or read back.
    #[inline]
    pub fn get(&mut self, index: u64) -> Result<R, StoreError> {
        assert!(index < self.len, "index {index} of a table of {}", self.len);
        match &mut self.paged {
            None => Ok(self.resident[index as usize]),
            Some(paged) => {
                let (slot, at) = paged.find(index)?;
                Ok(paged.slots[slot].records[at])
            }
        }
    }

    /// Replaces the record at `index`, which is below [`Table::len`].
    ///
    /// # Errors
    /// A block cannot be written or read back.
    #[inline]
    pub fn set(&mut self, index: u64, record: R) -> Result<(), StoreError> {
        assert!(index < self.len, "index {index} of a table of {}", self.len);
        match &mut self.paged {
            None => self.resident[index as usize] = record,
            Some(paged) => {
                let (slot, at) = paged.find(index)?;
                paged.slots[slot].records[at] = record;
                paged.slots[slot].dirty = true;
            }
        }
        Ok(())
    }

    /// Moves all records to disk and goes on with cached blocks.
    fn page_out(&mut self) -> Result<(), StoreError> {
        let file = self.scratch.anonymous("table")?;
        file.write_at(bytemuck::cast_slice(&self.resident), 0)?;
        self.resident = Vec::new();
        let block_bytes = (self.share_bytes / 8).clamp(LEAST_BLOCK_BYTES, self.most_block_bytes);
        let block_shift = (block_bytes / size_of::<R>()).max(1).ilog2();
        let block_records = 1 << block_shift;
        let slot_count = (self.share_bytes / (block_records * size_of::<R>())).max(2);
        self.paged = Some(Paged {
            file,
            block_records,
            block_shift,
            slots: Vec::new(),
            slot_of_block: Vec::new(),
            slot_count,
            hand: 0,
            last: (NO_BLOCK, 0),
        });
        Ok(())
    }
}

impl<R: Pod> Paged<R> {
    /// Slot and place in it of a record, after loading its block.
    #[inline]
    fn find(&mut self, index: u64) -> Result<(usize, usize), StoreError> {
        let block = index >> self.block_shift;
        let at = index as usize & (self.block_records - 1);
        if self.last.0 == block {
            return Ok((self.last.1, at));
        }
        let slot = match self.slot_of_block.get(block as usize) {
            Some(&slot) if slot != NO_SLOT => slot as usize,
            _ => self.load(block)?,
        };
        self.slots[slot].used = true;
        self.last = (block, slot);
        Ok((slot, at))
    }

    /// Reads a block into a free or evicted slot (second chance).
    #[cold]
    fn load(&mut self, block: u64) -> Result<usize, StoreError> {
        let slot = if self.slots.len() < self.slot_count {
            let records = vec![R::zeroed(); self.block_records];
            self.slots.push(Slot { block: NO_BLOCK, records, dirty: false, used: false });
            self.slots.len() - 1
        } else {
            while std::mem::take(&mut self.slots[self.hand].used) {
                self.hand = (self.hand + 1) % self.slots.len();
            }
            let slot = self.hand;
            self.hand = (self.hand + 1) % self.slots.len();
            slot
        };
        let victim = &mut self.slots[slot];
        let block_bytes = (self.block_records * size_of::<R>()) as u64;
        if victim.dirty {
            let bytes: &[u8] = bytemuck::cast_slice(&victim.records);
            self.file.write_at(bytes, victim.block * block_bytes)?;
        }
        if victim.block != NO_BLOCK {
            self.slot_of_block[victim.block as usize] = NO_SLOT;
        }
        victim.records.fill(R::zeroed());
        read_up_to(&self.file, &mut victim.records, block * block_bytes)?;
        victim.block = block;
        victim.dirty = false;
        if self.slot_of_block.len() <= block as usize {
            self.slot_of_block.resize(block as usize + 1, NO_SLOT);
        }
        self.slot_of_block[block as usize] = slot as u32;
        self.last = (NO_BLOCK, 0);
        Ok(slot)
    }
}

/// Reads what the file holds from `offset` on; the rest stays zero (the file ends in mid-block).
fn read_up_to<R: Pod>(
    file: &ScratchFile,
    records: &mut [R],
    offset: u64,
) -> Result<(), StoreError> {
    let end = file.len_bytes()?;
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(records);
    let there = end.saturating_sub(offset).min(bytes.len() as u64) as usize;
    file.read_at(&mut bytes[..there], offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paged_table_answers_like_a_resident_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut table = Table::<[f64; 3]>::new(&scratch, 16 << 10);
        for i in 0..20_000 {
            table.push([f64::from(i), 0.5, -f64::from(i)]).expect("push works");
        }
        assert!(table.paged.is_some());
        table.set(17, [1.0, 2.0, 3.0]).expect("set works");
        let mut index = 1_u64;
        for _ in 0..20_000 {
            index = (index * 48_271) % 20_000;
            let expected =
                if index == 17 { [1.0, 2.0, 3.0] } else { [index as f64, 0.5, -(index as f64)] };
            assert_eq!(table.get(index).expect("get works"), expected);
        }
        assert_eq!(table.get(17).expect("get works"), [1.0, 2.0, 3.0]);
    }
}
