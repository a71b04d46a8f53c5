//! A folder of models and one of results, for tests of batches from outside.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::obj::unwelded_obj;
use brickmend::catalogue::Journal;
use brickmend::mesh::shapes::{cuboid, sphere, torus};
use rustix::process::Pid;
use tempfile::TempDir;

/// A folder of models and one of results.
pub struct Library {
    pub folder: TempDir,
}

impl Library {
    /// Models in several formats and folders, one of them no model at all, one without a defect.
    pub fn new() -> Self {
        let library = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        let open = &cuboid([0.0; 3], [1.0, 2.0, 3.0])[2..];
        let ball = sphere([0.0; 3], 1.0, 6);
        library.write("a/open.obj".as_ref(), &unwelded_obj(open));
        library.write("a/deep er/ball.OBJ".as_ref(), &unwelded_obj(&ball[1..]));
        library.write(OsStr::from_bytes(b"a/na\xffme.obj").as_ref(), &unwelded_obj(open));
        library.write("b/sound.off".as_ref(), SOUND);
        library.write("b/torn.obj".as_ref(), "v 0 0 0\nf 1 2 3\n");
        library.write("b/notes.txt".as_ref(), "no model");
        for number in 0..6 {
            let corner = [f64::from(number), 0.0, 0.0];
            let cube = cuboid(corner, [f64::from(number) + 1.0, 1.0, 1.0]);
            library.write(format!("c/{number}.obj").as_ref(), &unwelded_obj(&cube[1..]));
        }
        library
    }

    pub fn models(&self) -> PathBuf {
        self.folder.path().join("models")
    }

    pub fn results(&self) -> PathBuf {
        self.folder.path().join("results")
    }

    pub fn write(&self, relative: &Path, text: &str) {
        let path = self.models().join(relative);
        std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
        std::fs::write(path, text).expect("writable");
    }

    pub fn command(&self, results: &Path) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("batch").arg(self.models()).arg("-o").arg(results);
        command.args(["--depth", "5", "--max-memory", "256MiB", "--jobs", "2", "--json"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs the batch; its exit code and what it tells.
    pub fn batch(&self, extra: &[&str]) -> (i32, serde_json::Value) {
        let run = self.command(&self.results()).args(extra).output().expect("the program starts");
        let told = String::from_utf8_lossy(&run.stderr).into_owned();
        let summary = serde_json::from_slice(&run.stdout).unwrap_or_default();
        (run.status.code().unwrap_or_else(|| panic!("{told}")), summary)
    }

    /// Number of attempts at models so far, over all runs.
    pub fn attempts(&self) -> usize {
        let names = ["a/open.obj", "a/deep er/ball.OBJ", "b/sound.off"];
        let numbers = (0..6).map(|number| format!("c/{number}.obj"));
        let names = names.iter().map(|&name| name.to_owned()).chain(numbers);
        names.map(|name| self.why(&name)["attempts"].as_array().map_or(0, Vec::len)).sum()
    }

    pub fn why(&self, model: &str) -> serde_json::Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("status").arg(self.results()).args(["--json", "--why", model]);
        let told = command.output().expect("the program starts");
        serde_json::from_slice(&told.stdout).expect("JSON")
    }
}

/// A tetrahedron, closed and outward.
pub const SOUND: &str =
    "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

/// All files below a folder with their bytes, but for the catalogue's own.
pub fn files_in(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("listable") {
            let path = entry.expect("listable").path();
            if path.file_name() == Some(".brickmend".as_ref()) {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                let relative = path.strip_prefix(folder).expect("below").to_path_buf();
                files.insert(relative, std::fs::read(&path).expect("readable"));
            }
        }
    }
    files
}

/// Kills a process without a warning.
pub fn kill(child: &mut Child) {
    child.kill().expect("it is ours");
    child.wait().expect("it is ours");
}

/// One model that takes a while.
pub fn slow_library() -> Library {
    let library = Library { folder: tempfile::tempdir().expect("a temporary folder") };
    library.write("slow.obj".as_ref(), &unwelded_obj(&torus(1.0, 0.4, 60, 30)[1..]));
    library
}

/// A run at a depth that takes a while, once a worker is set to the model.
pub fn start_slowly(library: &Library) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("batch").arg(library.models()).arg("-o").arg(library.results());
    command.args(["--depth", "9", "--max-memory", "256MiB", "--jobs", "1", "--quiet"]);
    let mut child = command.spawn().expect("the program starts");
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(30) {
        // The journal may not be there yet.
        let journal = Journal::open_to_read(&library.results());
        if let Ok(Ok(summary)) = journal.map(|mut journal| journal.summary())
            && !summary.under_way.is_empty()
        {
            return child;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    kill(&mut child);
    panic!("no worker was set to the model");
}

/// Processes whose parent is this one.
pub fn children_of(parent: u32) -> Vec<Pid> {
    let parent_of = |pid: i32| -> Option<u32> {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()
    };
    let entries = std::fs::read_dir("/proc").expect("Linux").flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok());
    pids.filter(|&pid| parent_of(pid) == Some(parent)).filter_map(Pid::from_raw).collect()
}
