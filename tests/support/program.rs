//! The program as a process of its own, with a system that may fail under it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use tempfile::TempDir;

/// Compiles `tests/shim/faults.rs`, once.
pub fn shim() -> &'static Path {
    static SHIM: OnceLock<PathBuf> = OnceLock::new();
    SHIM.get_or_init(|| {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/shim/faults.rs");
        let name = format!("faults-{}.so", std::process::id());
        let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let mut compiler = Command::new(option_env!("RUSTC").unwrap_or("rustc"));
        compiler.args(["--edition", "2024", "-O", "--crate-type", "cdylib", "-o"]);
        let compiled = compiler.arg(&library).arg(source).output().expect("rustc starts");
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        library
    })
}

/// How a process ended.
pub struct Ended {
    /// The exit code; `None` after a signal.
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
    /// Whether the shim struck.
    pub is_struck: bool,
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        const STRUCK: &str = "shim: struck\n";
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            is_struck: stderr.contains(STRUCK),
            stderr: stderr.replace(STRUCK, ""),
        }
    }
}

impl Ended {
    /// The outcome that was printed.
    pub fn outcome(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).expect("stdout is JSON")
    }

    /// One line that says what was wrong.
    pub fn assert_says_one_line(&self) {
        let lines = self.stderr.lines().count();
        assert!(lines == 1 && self.stderr.starts_with("brickmend: "), "{:?}", self.stderr);
    }
}

/// One model, one output, and the folder that both lie in.
pub struct Bench {
    folder: TempDir,
    arguments: Vec<String>,
}

impl Bench {
    /// A place to repair `model` in, always with these arguments.
    pub fn new(model: &Path, extension: &str, arguments: &[&str]) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let input = folder.path().join("in").with_extension(model.extension().unwrap_or_default());
        std::fs::copy(model, &input).expect("a copy");
        let output = folder.path().join(format!("out.{extension}"));
        let mut all = vec!["repair".to_owned(), input.to_string_lossy().into_owned()];
        all.extend(["-o".to_owned(), output.to_string_lossy().into_owned(), "--json".to_owned()]);
        all.extend(arguments.iter().map(|&argument| argument.to_owned()));
        Self { folder, arguments: all }
    }

    /// The program, about to be started.
    pub fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.args(&self.arguments);
        command
    }

    /// The program behind a shell that sets limits first.
    pub fn command_after(&self, shell: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("{shell}; exec \"$0\" \"$@\"")]);
        command.arg(env!("CARGO_BIN_EXE_brickmend")).args(&self.arguments);
        command
    }

    pub fn run(&self) -> Ended {
        self.command().output().expect("the program starts").into()
    }

    /// Runs with the shim and this setting of it.
    pub fn run_with(&self, setting: &str, value: u64) -> Ended {
        let mut command = self.command();
        command.env("LD_PRELOAD", shim()).env(setting, value.to_string());
        command.output().expect("the program starts").into()
    }

    pub fn output(&self) -> PathBuf {
        PathBuf::from(&self.arguments[3])
    }

    pub fn work_folder(&self) -> PathBuf {
        let mut name = self.output().into_os_string();
        name.push(".brickmend");
        name.into()
    }

    /// The bytes of the output, which is then removed; nothing else may be left.
    pub fn take_output(&self) -> Vec<u8> {
        let bytes = std::fs::read(self.output()).expect("the output is there");
        std::fs::remove_file(self.output()).expect("removable");
        self.assert_tidy();
        bytes
    }

    /// Nothing is left but the input.
    pub fn assert_tidy(&self) {
        let entries = std::fs::read_dir(self.folder.path()).expect("the folder is there");
        let names: Vec<_> = entries.map(|entry| entry.expect("listable").file_name()).collect();
        assert_eq!(names.len(), 1, "{names:?}");
    }
}
