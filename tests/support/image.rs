//! Images of a work folder in the middle of a run: what a kill at that moment would leave.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use brickmend::io::Format;
use brickmend::monitor::{Monitor, Void};
use brickmend::repair::{Limits, Outcome, RepairError, Settings, repair};
use tempfile::TempDir;

/// A folder with everything of a run in it.
pub struct Place {
    folder: TempDir,
}

impl Place {
    pub fn new() -> Self {
        Self { folder: TempDir::new().expect("a temporary folder") }
    }

    pub fn output(&self) -> PathBuf {
        self.folder.path().join("out.ply")
    }

    pub fn work_folder(&self) -> PathBuf {
        self.folder.path().join("out.ply.brickmend")
    }

    /// Repairs `input` here.
    pub fn repair(
        &self,
        input: &Path,
        settings: &Settings,
        limits: &Limits,
        monitor: &dyn Monitor,
    ) -> Result<Outcome, RepairError> {
        repair(input, &self.output(), Format::Ply, settings, limits, monitor)
    }

    /// Goes on here, to the end; the bytes of the output.
    pub fn resume(&self, input: &Path, settings: &Settings, limits: &Limits) -> (Outcome, Vec<u8>) {
        let outcome = self.repair(input, settings, limits, &Void).expect("it goes on");
        assert!(!self.work_folder().exists(), "the work folder is left over");
        (outcome, std::fs::read(self.output()).expect("the output is there"))
    }
}

/// A moment of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moment {
    /// The step that noted its progress, and how far it was; empty between checkpoints.
    pub step: String,
    pub items: u64,
}

/// Takes an image at every checkpoint, and at every `stride`-th event between them.
pub struct Photographer {
    work_folder: PathBuf,
    stride: u64,
    state: Mutex<(u64, Vec<(Moment, Place)>)>,
}

impl Photographer {
    pub fn new(place: &Place, stride: u64) -> Self {
        Self { work_folder: place.work_folder(), stride, state: Mutex::default() }
    }

    /// The images, in order.
    pub fn images(self) -> Vec<(Moment, Place)> {
        self.state.into_inner().expect("no test panicked").1
    }

    fn take(&self, moment: Moment, images: &mut Vec<(Moment, Place)>) {
        let image = Place::new();
        copy_folder(&self.work_folder, &image.work_folder());
        images.push((moment, image));
    }
}

impl Monitor for Photographer {
    fn advance(&self, _: u64) {
        let mut state = self.state.lock().expect("no test panicked");
        state.0 += 1;
        if state.0.is_multiple_of(self.stride) {
            self.take(Moment { step: String::new(), items: 0 }, &mut state.1);
        }
    }

    fn checkpoint(&self, step: &str, items: u64) {
        let mut state = self.state.lock().expect("no test panicked");
        self.take(Moment { step: step.to_owned(), items }, &mut state.1);
    }
}

pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("writable");
    for entry in std::fs::read_dir(from).expect("readable") {
        let entry = entry.expect("readable");
        std::fs::copy(entry.path(), to.join(entry.file_name())).expect("a copy");
    }
}
