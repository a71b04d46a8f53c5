//! The zip archive around a 3MF model: its directory, and its members as streams.
//!
//! In: a user's file. Out: members by [`part_key`], unpacked while they are read; nothing is
//! written to the disk under a name of the archive. Memory: the directory, at most
//! [`MOST_DIRECTORY_BYTES`] of the file; a block. Fails: archives that are cut, encrypted or packed
//! otherwise than by deflate; content that swells as no model does.

use std::collections::BTreeMap;
use std::io::{Error, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use zip::ZipArchive;
use zip::read::{ArchiveOffset, Config, ZipFile};
use zip::result::ZipError;

use crate::io::error::{IoError, Place};
use crate::io::input::Input;
use crate::io::packed::{HARMLESS_BYTES, MOST_RATIO};
use crate::io::threemf::part_name::part_key;

/// The most members of an archive.
const MOST_MEMBERS: u64 = 1 << 14;
/// The most that is read of the file before its members are known.
const MOST_DIRECTORY_BYTES: u64 = 4 << 20;
/// How far from the end of the file the end of the directory begins: its record, and a comment.
const END_BYTES: u64 = (64 << 10) + 256;
const END: &[u8] = b"PK\x05\x06";
const END64: &[u8] = b"PK\x06\x06";
const LOCATOR64: &[u8] = b"PK\x06\x07";
/// The record in front of a locator, without the room for extensions.
const END64_BYTES: u64 = 56;

/// Numbers of the members by the keys of their names.
pub(super) type Members = Arc<BTreeMap<String, usize>>;

/// An archive whose directory is known.
pub(super) struct Archive {
    path: PathBuf,
    zip: ZipArchive<Bytes>,
    members: Members,
    size_bytes: u64,
    /// Bytes of the members that were opened, packed and unpacked.
    packed_bytes: u64,
    unpacked_bytes: u64,
    /// Bytes of the user's file that were read.
    consumed_bytes: Arc<AtomicU64>,
}

impl Archive {
    /// Reads the directory of an archive.
    pub(super) fn open(mut input: Input) -> Result<Self, IoError> {
        check_end(&mut input)?;
        let (path, size_bytes) = (input.path().to_path_buf(), input.size_bytes());
        let budget = Arc::new(AtomicU64::new(MOST_DIRECTORY_BYTES));
        let consumed_bytes = Arc::new(AtomicU64::new(0));
        let consumed = Arc::clone(&consumed_bytes);
        let bytes = Bytes { input, budget: Arc::clone(&budget), consumed };
        // A fixed offset: no search through the file, whose finds would be held in memory.
        let config = Config { archive_offset: ArchiveOffset::Known(0) };
        let zip = ZipArchive::with_config(config, bytes).map_err(|error| {
            of_zip(error, &path, Place::Byte(size_bytes), "a zip archive up to its directory")
        })?;
        budget.store(u64::MAX, Ordering::Relaxed);
        let mut members = BTreeMap::new();
        for (number, name) in zip.file_names_raw().enumerate() {
            members.entry(part_key(&String::from_utf8_lossy(name))).or_insert(number);
        }
        let members = Arc::new(members);
        Ok(Self {
            path,
            zip,
            members,
            size_bytes,
            packed_bytes: 0,
            unpacked_bytes: 0,
            consumed_bytes,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn members(&self) -> &Members {
        &self.members
    }

    /// The content of a member.
    pub(super) fn member(&mut self, number: usize) -> Result<Unpacked<'_>, IoError> {
        let start = self.zip.by_index_data(number).map_or(0, |entry| entry.header_start());
        let member = self.zip.by_index(number).map_err(|error| {
            of_zip(error, &self.path, Place::Byte(start), "a member that is packed by deflate")
        })?;
        // What the directory says of sizes may lie; the file has no more than it has.
        self.packed_bytes = (self.packed_bytes + member.compressed_size().min(self.size_bytes))
            .min(self.size_bytes);
        Ok(Unpacked {
            path: &self.path,
            member,
            packed_bytes: self.packed_bytes,
            unpacked_bytes: &mut self.unpacked_bytes,
        })
    }

    /// Bytes of the user's file that were read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.consumed_bytes.load(Ordering::Relaxed)
    }
}

/// The content of a member, as far as it is in proportion to the file.
pub(super) struct Unpacked<'a> {
    path: &'a Path,
    member: ZipFile<'a, Bytes>,
    packed_bytes: u64,
    unpacked_bytes: &'a mut u64,
}

impl Read for Unpacked<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let count = self.member.read(bytes)?;
        *self.unpacked_bytes += count as u64;
        let (unpacked_bytes, read_bytes) = (*self.unpacked_bytes, self.packed_bytes);
        if unpacked_bytes > HARMLESS_BYTES && unpacked_bytes / MOST_RATIO > read_bytes {
            let path = self.path.to_path_buf();
            return Err(Error::other(IoError::Bomb { path, unpacked_bytes, read_bytes }));
        }
        Ok(count)
    }
}

/// The user's file as the zip crate wants it; its errors travel inside of those of `std`.
struct Bytes {
    input: Input,
    /// How much may still be read.
    budget: Arc<AtomicU64>,
    consumed: Arc<AtomicU64>,
}

impl Read for Bytes {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        if self.input.available().is_empty() {
            self.input.fill().map_err(Error::other)?;
        }
        let available = self.input.available();
        let count = available.len().min(bytes.len());
        let left = self.budget.load(Ordering::Relaxed);
        if count as u64 > left {
            let what = "bytes in the directory of its archive";
            let path = self.input.path();
            return Err(Error::other(IoError::too_many(path, what, MOST_DIRECTORY_BYTES)));
        }
        self.budget.store(left - count as u64, Ordering::Relaxed);
        bytes[..count].copy_from_slice(&available[..count]);
        self.input.consume(count);
        self.consumed.store(self.input.bytes_read(), Ordering::Relaxed);
        Ok(count)
    }
}

impl Seek for Bytes {
    fn seek(&mut self, place: SeekFrom) -> std::io::Result<u64> {
        let target = match place {
            SeekFrom::Start(offset) => Some(offset),
            SeekFrom::End(distance) => self.input.size_bytes().checked_add_signed(distance),
            SeekFrom::Current(distance) => self.input.offset().checked_add_signed(distance),
        };
        // Further than that no file reaches, and arithmetic stays safe.
        let target = target.filter(|&target| target <= i64::MAX as u64);
        let target = target.ok_or(std::io::ErrorKind::InvalidInput)?;
        self.input.seek(target);
        Ok(target)
    }
}

/// Refuses counts of members that the zip crate would reserve memory for before it reads them.
fn check_end(input: &mut Input) -> Result<(), IoError> {
    let size_bytes = input.size_bytes();
    let start = size_bytes.saturating_sub(END_BYTES);
    let end = read_at(input, start, size_bytes - start)?;
    for at in (0..end.len()).filter(|&at| end[at..].starts_with(END)) {
        let count = number(&end, at + 10, 2);
        let mut is_fine = count.is_none_or(|count| count <= MOST_MEMBERS);
        // The record for large archives stands in front, and its locator between the two.
        let locator = start + at as u64;
        if let Some(locator) = locator.checked_sub(20)
            && let bytes = read_at(input, locator, 20)?
            && bytes.starts_with(LOCATOR64)
        {
            let record = number(&bytes, 8, 8).unwrap_or_default();
            let bytes = read_at(input, record, END64_BYTES)?;
            let counts = [number(&bytes, 24, 8), number(&bytes, 32, 8)];
            let is_small = counts.iter().flatten().all(|&count| count <= MOST_MEMBERS)
                && locator.saturating_sub(record) <= END_BYTES;
            let is_marked = count == Some(u64::from(u16::MAX));
            is_fine = !bytes.starts_with(END64) || is_small && (is_fine || is_marked);
        }
        if !is_fine {
            return Err(IoError::too_many(input.path(), "members in its archive", MOST_MEMBERS));
        }
    }
    input.seek(0);
    Ok(())
}

/// Up to `count` bytes of a place in the file.
fn read_at(input: &mut Input, offset: u64, count: u64) -> Result<Vec<u8>, IoError> {
    let mut bytes = Vec::new();
    input.seek(offset.min(input.size_bytes()));
    while (bytes.len() as u64) < count {
        if input.available().is_empty() && !input.fill()? {
            break;
        }
        let left = (count - bytes.len() as u64).min(input.available().len() as u64);
        bytes.extend_from_slice(input.take(left as usize));
    }
    Ok(bytes)
}

/// A little-endian number of up to eight bytes.
fn number(bytes: &[u8], at: usize, count: usize) -> Option<u64> {
    let mut number = [0; 8];
    number[..count].copy_from_slice(bytes.get(at..at + count)?);
    Some(u64::from_le_bytes(number))
}

fn of_zip(error: ZipError, path: &Path, place: Place, expected: &str) -> IoError {
    match error {
        ZipError::Io(error) => of_std(error, path, place, expected),
        error => IoError::unreadable(path, place, expected, error.to_string()),
    }
}

/// What really failed where reading through layers of `std` did.
pub(super) fn of_std(error: Error, path: &Path, place: Place, expected: &str) -> IoError {
    match error.downcast::<IoError>() {
        Ok(error) => error,
        Err(error) => IoError::unreadable(path, place, expected, error.to_string()),
    }
}
