//! Spools of triangles of the soup: where every coordinate is one of single precision, as most files have
//! them, in half of the bytes.
//!
//! In:         triangles in any order.
//! Out:        the same, bit by bit but for the sign of a zero; which of the two forms a spool has is told
//!             by its length.
//! Invariant:  a spool is narrow exactly if all its triangles are.
//! Memory:     as [`Spool`], and what is read at one time once more.
//! Fails:      as [`Spool`].

use bytemuck::{Pod, Zeroable};

use crate::octree::SoupTriangle;
use crate::store::{FileState, Scratch, Spool, SpoolReader, SpoolWriter, StoreError};

/// A triangle of the input whose coordinates are of single precision. 48 bytes; see
/// docs/format.md.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct NarrowTriangle {
    /// Finite corners as read, model units.
    pub corners: [[f32; 3]; 3],
    /// As [`SoupTriangle::source`].
    pub source: u32,
    /// Part number.
    pub part: u32,
    /// As [`SoupTriangle::material`].
    pub material: u32,
}

impl NarrowTriangle {
    /// The triangle, if nothing of it is lost.
    #[inline]
    fn of(triangle: &SoupTriangle) -> Option<Self> {
        let SoupTriangle { corners, source, part, material, stands_for } = *triangle;
        let narrow = corners.map(|corner| corner.map(|c| c as f32));
        let is_same =
            |corner: usize| (0..3).all(|a| f64::from(narrow[corner][a]) == corners[corner][a]);
        (stands_for == 0 && (0..3).all(is_same)).then_some(Self {
            corners: narrow,
            source,
            part,
            material,
        })
    }

    #[inline]
    fn wide(&self) -> SoupTriangle {
        let Self { corners, source, part, material } = *self;
        let corners = corners.map(|corner| corner.map(f64::from));
        SoupTriangle { corners, source, part, material, stands_for: 0 }
    }
}

/// Appends triangles to a spool.
pub struct SoupWriter {
    scratch: Scratch,
    name: String,
    /// What came so far, until it is clear that not all of it is narrow.
    narrow: Option<SpoolWriter<NarrowTriangle>>,
    wide: Option<SpoolWriter<SoupTriangle>>,
}

impl SoupWriter {
    /// Starts the spool `name`, replacing an older one.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        let narrow = Some(SpoolWriter::create(scratch, name)?);
        Ok(Self { scratch: scratch.clone(), name: name.to_owned(), narrow, wide: None })
    }

    /// Appends a triangle.
    ///
    /// # Errors
    /// The disk is full.
    #[inline]
    pub fn push(&mut self, triangle: SoupTriangle) -> Result<(), StoreError> {
        if let Some(writer) = &mut self.narrow
            && let Some(triangle) = NarrowTriangle::of(&triangle)
        {
            return writer.push(triangle);
        }
        match &mut self.wide {
            Some(writer) => writer.push(triangle),
            None => self.widen(triangle),
        }
    }

    /// Appends the first triangle that is not narrow: what came so far is written anew.
    #[cold]
    fn widen(&mut self, triangle: SoupTriangle) -> Result<(), StoreError> {
        let narrow = self.narrow.take().map(SpoolWriter::finish).transpose()?;
        // What has lost its name is there as long as it is open.
        self.scratch.remove(&self.name)?;
        let mut wide = SpoolWriter::create(&self.scratch, &self.name)?;
        if let Some(narrow) = narrow {
            let mut reader = narrow.reader(0, narrow.len());
            while let Some(block) = reader.next_block()? {
                block.iter().try_for_each(|triangle| wide.push(triangle.wide()))?;
            }
        }
        wide.push(triangle)?;
        self.wide = Some(wide);
        Ok(())
    }

    /// The number of triangles so far.
    #[must_use]
    pub fn len(&self) -> u64 {
        let narrow = self.narrow.as_ref().map_or(0, SpoolWriter::len);
        self.wide.as_ref().map_or(narrow, SpoolWriter::len)
    }

    /// Whether nothing was appended.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Completes the spool.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> Result<SoupSpool, StoreError> {
        let form = match (self.narrow, self.wide) {
            (Some(narrow), _) => Form::Narrow(narrow.finish()?),
            (None, Some(wide)) => Form::Wide(wide.finish()?),
            (None, None) => Form::Narrow(SpoolWriter::create(&self.scratch, &self.name)?.finish()?),
        };
        Ok(SoupSpool { form })
    }
}

enum Form {
    Narrow(Spool<NarrowTriangle>),
    Wide(Spool<SoupTriangle>),
}

/// A finished spool of triangles. Shared freely between threads.
pub struct SoupSpool {
    form: Form,
}

impl SoupSpool {
    /// Opens a spool that an earlier run finished.
    ///
    /// # Errors
    /// It is missing, cut short, of another version, or not what `state` says.
    pub fn open(scratch: &Scratch, state: &FileState) -> Result<Self, StoreError> {
        let narrow_bytes = Spool::<NarrowTriangle>::file_bytes(state.records);
        let form = if narrow_bytes == Some(state.len_bytes) {
            Form::Narrow(Spool::open(scratch, state)?)
        } else {
            Form::Wide(Spool::open(scratch, state)?)
        };
        Ok(Self { form })
    }

    /// How it is found again.
    #[must_use]
    pub fn state(&self) -> &FileState {
        match &self.form {
            Form::Narrow(spool) => spool.state(),
            Form::Wide(spool) => spool.state(),
        }
    }

    /// The number of triangles.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.state().records
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Replaces `triangles` by those from `first` on, at most `count` of them.
    ///
    /// # Errors
    /// As [`Spool::read`].
    pub fn read(
        &self,
        first: u64,
        count: usize,
        triangles: &mut SoupBlock,
    ) -> Result<(), StoreError> {
        let SoupBlock { wide, narrow } = triangles;
        match &self.form {
            Form::Wide(spool) => spool.read(first, count, wide),
            Form::Narrow(spool) => {
                spool.read(first, count, narrow)?;
                wide.clear();
                wide.extend(narrow.iter().map(NarrowTriangle::wide));
                Ok(())
            }
        }
    }

    /// Reads the triangles `first..first + count` block by block.
    #[must_use]
    pub fn reader(&self, first: u64, count: u64) -> SoupReader<'_> {
        let form = match &self.form {
            Form::Narrow(spool) => ReaderForm::Narrow(spool.reader(first, count), Vec::new()),
            Form::Wide(spool) => ReaderForm::Wide(spool.reader(first, count)),
        };
        SoupReader { form }
    }
}

/// Triangles that were read from a spool, and room for the next.
#[derive(Default)]
pub struct SoupBlock {
    wide: Vec<SoupTriangle>,
    narrow: Vec<NarrowTriangle>,
}

impl SoupBlock {
    /// Takes the triangles out.
    #[must_use]
    pub fn take(&mut self) -> Vec<SoupTriangle> {
        std::mem::take(&mut self.wide)
    }
}

impl std::ops::Deref for SoupBlock {
    type Target = [SoupTriangle];
    fn deref(&self) -> &[SoupTriangle] {
        &self.wide
    }
}

enum ReaderForm<'s> {
    /// With the triangles as they are handed on.
    Narrow(SpoolReader<'s, NarrowTriangle>, Vec<SoupTriangle>),
    Wide(SpoolReader<'s, SoupTriangle>),
}

/// Reads a range of a spool of triangles block by block.
pub struct SoupReader<'s> {
    form: ReaderForm<'s>,
}

impl SoupReader<'_> {
    /// Goes on with the triangles `first..first + count`.
    pub fn turn_to(&mut self, first: u64, count: u64) {
        match &mut self.form {
            ReaderForm::Narrow(reader, _) => reader.turn_to(first, count),
            ReaderForm::Wide(reader) => reader.turn_to(first, count),
        }
    }

    /// The next triangles, `None` at the end.
    ///
    /// # Errors
    /// The disk fails.
    pub fn next_block(&mut self) -> Result<Option<&[SoupTriangle]>, StoreError> {
        match &mut self.form {
            ReaderForm::Wide(reader) => reader.next_block(),
            ReaderForm::Narrow(reader, triangles) => {
                let Some(block) = reader.next_block()? else { return Ok(None) };
                triangles.clear();
                triangles.extend(block.iter().map(NarrowTriangle::wide));
                Ok(Some(triangles))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(source: u32, is_wide: bool) -> SoupTriangle {
        let x = if is_wide { 0.1 } else { 0.25 };
        let corners = [[x, -0.5, f64::from(source)], [1e30_f32.into(), 0.0, 2.0], [x, x, -3.0]];
        SoupTriangle { corners, source, part: source / 7, material: 1 << 31, stands_for: 0 }
    }

    #[test]
    fn triangles_come_back_whatever_the_form_and_when_it_changes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        for count in [0, 1, 3, 5000] {
            for first_wide in [0, 1, 4000, 10_000] {
                let all: Vec<_> = (0..count).map(|i| triangle(i, i == first_wide)).collect();
                let mut writer = SoupWriter::create(&scratch, "soup").expect("create works");
                all.iter().for_each(|t| writer.push(*t).expect("push works"));
                assert_eq!(writer.len(), u64::from(count));
                let state = writer.finish().expect("finish works").state().clone();
                let soup = SoupSpool::open(&scratch, &state).expect("open works");
                assert_eq!(matches!(soup.form, Form::Wide(_)), first_wide < count);
                let mut read = SoupBlock::default();
                soup.read(1, 4500, &mut read).expect("read works");
                let end = all.len().min(4501);
                assert_eq!(read[..], all[end.min(1)..end]);
                let mut reader = soup.reader(0, soup.len());
                let mut back = Vec::new();
                while let Some(block) = reader.next_block().expect("read works") {
                    back.extend_from_slice(block);
                }
                assert_eq!(back, all);
            }
        }
    }

    #[test]
    fn what_stands_for_a_triangle_keeps_that() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let added = SoupTriangle { stands_for: 5, ..triangle(1, false) };
        let mut writer = SoupWriter::create(&scratch, "soup").expect("create works");
        writer.push(added).expect("push works");
        let mut read = SoupBlock::default();
        writer.finish().expect("finish works").read(0, 9, &mut read).expect("read works");
        assert_eq!(read[..], [added]);
    }
}
