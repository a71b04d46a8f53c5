//! Brick files read back, go on where they were left, and find out when their bytes lie.

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;

use tempfile::TempDir;

use crate::mesh::shapes::Random;
use crate::store::{
    Backing, BrickFile, BrickWriter, FileState, Scratch, StoreError, directory_name,
};

const NAME: &str = "bricks";

fn record(key: u64) -> Vec<u8> {
    let len = if key.is_multiple_of(97) { 300_000 } else { (key * 7919 % 9000) as usize };
    (0..len).map(|i| (i as u64 * 31 + key) as u8).collect()
}

fn append(writer: &mut BrickWriter, keys: std::ops::Range<u64>) {
    for key in keys {
        writer.append(key * 3, key as u32, &record(key)).expect("append works");
    }
}

fn written(scratch: &Scratch, backing: Backing) -> BrickFile {
    let mut writer = BrickWriter::create(scratch, NAME, backing).expect("create works");
    append(&mut writer, 1..400);
    writer.finish(4).expect("finish works")
}

fn on_disk() -> (TempDir, Scratch, FileState) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let state = written(&scratch, Backing::Mapped).state().cloned().expect("it is on disk");
    (folder, scratch, state)
}

fn check_reads_back(file: &BrickFile) {
    assert_eq!(file.len(), 399);
    for key in (1..400).rev() {
        let number = file.find(key * 3).expect("the key is there");
        let view = file.view(number).expect("the record is whole");
        assert_eq!(view[..], record(key)[..]);
        assert_eq!(view.as_ptr() as usize % 16, 0);
    }
    assert_eq!(file.find(4), None);
}

#[test]
fn records_read_back_from_memory() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    check_reads_back(&written(&Scratch::new(folder.path()), Backing::Memory));
}

#[test]
fn records_read_back_from_mapped_windows_and_after_reopening() {
    let (_folder, scratch, state) = on_disk();
    // One window in a map, two, three and four.
    for cached_windows in [1, 2, 16, 24, 100] {
        check_reads_back(&BrickFile::open(&scratch, &state, cached_windows).expect("open works"));
    }
}

#[test]
fn a_writer_goes_on_where_an_earlier_one_was_saved() {
    let (_folder, scratch, whole) = on_disk();
    let bytes = std::fs::read(scratch.path(NAME)).expect("the file is there");
    // 97 is the long record: windows of its own.
    for saved_at in [1, 2, 97, 98, 200, 399, 400] {
        let mut writer =
            BrickWriter::create(&scratch, NAME, Backing::Mapped).expect("create works");
        append(&mut writer, 1..saved_at);
        let state = writer.save().expect("save works").expect("it is on disk");
        // What comes after the checkpoint does not count.
        append(&mut writer, saved_at..(saved_at + 50).min(400));
        drop(writer);
        let mut writer = BrickWriter::reopen(&scratch, &state).expect("reopen works");
        append(&mut writer, saved_at..400);
        let file = writer.finish(4).expect("finish works");
        check_reads_back(&file);
        assert_eq!(file.state(), Some(&whole), "saved at {saved_at}");
        assert!(std::fs::read(scratch.path(NAME)).expect("there")[..bytes.len()] == bytes);
    }
}

/// Every record that cannot be read, after the files were changed; opening may fail as well.
fn failures(scratch: &Scratch, state: &FileState) -> Vec<usize> {
    let Ok(bricks) = BrickFile::open(scratch, state, 2) else { return (0..399).collect() };
    let is_damaged = |number: &usize| match bricks.view(*number) {
        Ok(view) => {
            assert_eq!(view[..], record(*number as u64 + 1)[..], "a wrong record was believed");
            false
        }
        Err(StoreError::Damaged { .. }) => true,
        Err(other) => panic!("{other}"),
    };
    (0..399).filter(is_damaged).collect()
}

fn change(scratch: &Scratch, name: &str, at: u64, with: impl Fn(&mut [u8]), len: usize) {
    let file = OpenOptions::new().read(true).write(true).open(scratch.path(name)).expect("there");
    let mut bytes = vec![0; len];
    file.read_exact_at(&mut bytes, at).expect("inside of the file");
    with(&mut bytes);
    file.write_all_at(&bytes, at).expect("writable");
}

#[test]
fn ten_thousand_flipped_bits_of_records_are_found_at_their_first_touch() {
    let (_folder, scratch, state) = on_disk();
    let directory = BrickFile::open(&scratch, &state, 2).expect("open works").directory().to_vec();
    let file = OpenOptions::new().read(true).write(true).open(scratch.path(NAME)).expect("there");
    let mut random = Random::new(5);
    let mut flips = 0;
    while flips < 10_000 {
        let number = random.below(directory.len());
        let entry = directory[number];
        if entry.len_bytes == 0 {
            continue;
        }
        let at = entry.offset + random.below(entry.len_bytes as usize) as u64;
        let mut byte = [0];
        file.read_exact_at(&mut byte, at).expect("inside of the file");
        file.write_all_at(&[byte[0] ^ 1 << random.below(8)], at).expect("writable");
        let bricks = BrickFile::open(&scratch, &state, 2).expect("the directory is whole");
        let neighbour = (number + 1) % directory.len();
        assert!(matches!(bricks.view(number), Err(StoreError::Damaged { .. })), "byte {at}");
        assert!(bricks.view(neighbour).is_ok(), "byte {at}");
        file.write_all_at(&byte, at).expect("writable");
        flips += 1;
    }
    assert!(failures(&scratch, &state).is_empty());
}

#[test]
fn every_flipped_bit_of_a_directory_or_header_is_found_when_the_file_is_opened() {
    let (_folder, scratch, state) = on_disk();
    let directory = directory_name(NAME);
    for (name, range) in [(NAME, 0..16), (directory.as_str(), 0..16), (&directory, 64..4000)] {
        for at in range {
            change(&scratch, name, at, |bytes| bytes[0] ^= 1 << (at % 8), 1);
            assert!(BrickFile::open(&scratch, &state, 2).is_err(), "{name}, byte {at}");
            assert!(BrickWriter::reopen(&scratch, &state).is_err(), "{name}, byte {at}");
            change(&scratch, name, at, |bytes| bytes[0] ^= 1 << (at % 8), 1);
        }
    }
}

#[test]
fn swapped_records_zeroed_pages_and_cut_files_are_found() {
    let (_folder, scratch, state) = on_disk();
    let whole = std::fs::read(scratch.path(NAME)).expect("there");
    let directory = BrickFile::open(&scratch, &state, 2).expect("open works").directory().to_vec();
    // Two records of 16 bytes each, bytes for bytes.
    let (a, b) = (directory[9], directory[10]);
    let (from, to) = (a.offset as usize, b.offset as usize);
    let mut swapped = whole.clone();
    (0..16).for_each(|i| swapped.swap(from + i, to + i));
    std::fs::write(scratch.path(NAME), &swapped).expect("writable");
    assert_eq!(failures(&scratch, &state), [9, 10]);
    let mut zeroed = whole.clone();
    zeroed[8192..12_288].fill(0);
    std::fs::write(scratch.path(NAME), &zeroed).expect("writable");
    assert!(!failures(&scratch, &state).is_empty());
    for len in (0..whole.len()).step_by(65_536) {
        std::fs::write(scratch.path(NAME), &whole[..len]).expect("writable");
        assert!(!failures(&scratch, &state).is_empty(), "cut at {len}");
    }
    std::fs::write(scratch.path(NAME), &whole).expect("writable");
    // The whole file of another run, with its directory.
    let other = Scratch::new(&scratch.path(""));
    let mut writer = BrickWriter::create(&other, NAME, Backing::Mapped).expect("create works");
    (1..400).for_each(|key| writer.append(key * 3, 0, b"other").expect("append works"));
    drop(writer.finish(1).expect("finish works"));
    assert!(BrickFile::open(&scratch, &state, 2).is_err());
}
