//! Models with which nothing is wrong: copied byte for byte, not repaired.

use std::ffi::OsString;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::catalogue::stamp::Stamp;
use crate::io::{Format, ReadOptions, format_of_name};
use crate::monitor::Monitor;
use crate::repair::{Blame, Limits, MemoryPlan, RepairError};
use crate::store::{Scratch, StoreError, sync_folder};
use crate::verify::{Outward, ProofOptions, VerifyError, Vertices, prove};

/// What is read at a time.
const BLOCK_BYTES: usize = 64 << 10;

/// Copies `input` to `output`, whole or not at all, if it is sound and of the format that is asked
/// for; whether it was.
///
/// Sound is what every output of a repair is: closed, 2-manifold, consistently oriented outward,
/// without degenerate or intersecting triangles.
///
/// # Errors
/// The disk fails, or the monitor asks to stop. What is wrong with the input is none: the repair
/// tells it.
pub fn copy_if_sound(
    input: &Path,
    output: &Path,
    format: Format,
    limits: &Limits,
    monitor: &dyn Monitor,
) -> Result<bool, RepairError> {
    let is_packed =
        crate::io::unpacked_name(input) != input || input.extension() != output.extension();
    if is_packed || format_of_name(input) != Some(format) || format_of_name(output) != Some(format)
    {
        return Ok(false);
    }
    let before = Stamp::at(input);
    if !is_sound(input, limits, monitor)? || names_others(input, format)? {
        return Ok(false);
    }
    copy((input, before), output, limits)?;
    Ok(true)
}

/// Whether the model names files beside it: alone, its copy would be less than it. Where the word for
/// that stands in a remark, the model is repaired for nothing.
fn names_others(input: &Path, format: Format) -> Result<bool, StoreError> {
    let word: &[u8] = match format {
        Format::Obj => b"mtllib",
        Format::Ply => b"TextureFile",
        Format::Stl | Format::Off | Format::ThreeMf | Format::Glb => return Ok(false),
    };
    let mut file = File::open(input).map_err(|e| StoreError::io("open", input, e))?;
    let mut block = vec![0; BLOCK_BYTES];
    // The end of the block before, in which the word may begin.
    let mut kept = 0;
    loop {
        let count = match file.read(&mut block[kept..]) {
            Ok(0) => return Ok(false),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(StoreError::io("read", input, error)),
        };
        let end = kept + count;
        if block[..end].windows(word.len()).any(|part| part == word) {
            return Ok(true);
        }
        kept = end.min(word.len() - 1);
        block.copy_within(end - kept..end, 0);
    }
}

fn is_sound(input: &Path, limits: &Limits, monitor: &dyn Monitor) -> Result<bool, RepairError> {
    let plan = MemoryPlan::within(limits)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build();
    let threads = plan.threads;
    let pool = pool.map_err(|source| RepairError::Threads { threads, source })?;
    let folder = limits.work_dir.as_deref().unwrap_or(Path::new("."));
    let scratch = Scratch::new(folder);
    let share_bytes = plan.share_bytes;
    let options = ProofOptions {
        share_bytes,
        outward: Outward::AlternatesWithNesting,
        vertices: Vertices::Positions,
        intersections: true,
    };
    let mut open = || {
        let source = crate::io::open(input, &scratch, &ReadOptions::in_scene(share_bytes))?;
        Ok(source as Box<dyn crate::mesh::MeshSource<Error = _> + Send>)
    };
    match prove(&mut open, &scratch, &options, &pool, monitor) {
        Ok(proof) => Ok(proof.holds()),
        Err(VerifyError::Store(error)) => Err(error.into()),
        Err(VerifyError::Source { source }) => {
            let error = RepairError::Input(source);
            // What cannot be read is told by the repair, which has more to say of it.
            if error.blame() == Blame::Input { Ok(false) } else { Err(error) }
        }
    }
}

/// Through a file in the work folder if that is on the same file system, else one beside the output.
fn copy(
    (input, before): (&Path, Option<Stamp>),
    output: &Path,
    limits: &Limits,
) -> Result<(), RepairError> {
    let parent = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let device = |folder: &Path| std::fs::metadata(folder).map(|folder| folder.dev()).ok();
    let work = limits.work_dir.as_deref().filter(|folder| device(folder) == device(parent));
    let part = match work {
        Some(folder) => folder.join("output.part"),
        None => {
            let mut hidden = OsString::from(".");
            hidden.push(output.file_name().unwrap_or_default());
            hidden.push(".brickmend.part");
            parent.join(hidden)
        }
    };
    let copied = copy_to(input, &part).map_err(RepairError::from).and_then(|()| {
        if Stamp::at(input) != before {
            return Err(RepairError::InputChanged { path: input.to_path_buf() });
        }
        let placed = std::fs::rename(&part, output);
        Ok(placed.map_err(|e| StoreError::io("put in place", output, e))?)
    });
    if copied.is_err() {
        // What is left of it is of no use; that it cannot be removed changes nothing.
        let _ = std::fs::remove_file(&part);
    }
    copied?;
    Ok(sync_folder(parent)?)
}

fn copy_to(input: &Path, part: &Path) -> Result<(), StoreError> {
    let failed = |doing, path: &Path| {
        let path = path.to_path_buf();
        move |error| StoreError::io(doing, &path, error)
    };
    let mut from = File::open(input).map_err(failed("open", input))?;
    let mut to = File::create(part).map_err(failed("create", part))?;
    std::io::copy(&mut from, &mut to).map_err(failed("copy to", part))?;
    to.sync_all().map_err(failed("synchronise", part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_wherever_they_stand() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.obj");
        let names = |content: &[u8], format| {
            std::fs::write(&path, content).expect("writable");
            names_others(&path, format).expect("readable")
        };
        for before in [0, 7, BLOCK_BYTES - 9, BLOCK_BYTES - 3, 3 * BLOCK_BYTES] {
            let mut content = vec![b'#'; before];
            assert!(!names(&content, Format::Obj));
            content.extend(b"\nmtllib a.mtl\n");
            assert!(names(&content, Format::Obj), "{before}");
            assert!(!names(&content, Format::Ply));
        }
        assert!(names(b"ply\ncomment TextureFile a.png\n", Format::Ply));
        assert!(!names(b"mtllib", Format::Stl));
    }
}
