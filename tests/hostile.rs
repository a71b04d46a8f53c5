//! Input that lies, through the command line: a clear refusal or a repair, and nothing left over.

use std::ffi::{OsStr, OsString};
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::Command;

use flate2::Compression;
use flate2::write::GzEncoder;
use tempfile::TempDir;

/// What a run may take, whatever it is fed.
const BUDGET: &str = "256MiB";
const BUDGET_BYTES: u64 = 256 << 20;

struct Case {
    folder: TempDir,
    input: PathBuf,
}

impl Case {
    fn new(name: impl AsRef<OsStr>) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let input = folder.path().join(name.as_ref());
        Self { folder, input }
    }

    fn holding(name: impl AsRef<OsStr>, content: &[u8]) -> Self {
        let case = Self::new(name);
        std::fs::write(&case.input, content).expect("writable");
        case
    }

    fn names(&self) -> Vec<OsString> {
        let entries = std::fs::read_dir(self.folder.path()).expect("readable");
        let mut names: Vec<_> = entries.map(|entry| entry.expect("readable").file_name()).collect();
        names.sort();
        names
    }

    /// Runs a repair; its exit code. Refusals are one line, results are proved, and nothing else
    /// is left.
    fn run(&self, what: &str) -> i32 {
        let before = self.names();
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("repair").arg(&self.input).arg("-o").arg(self.folder.path().join("out.ply"));
        command.args(["--depth", "6", "--json", "--max-memory", BUDGET]);
        let run = command.output().expect("the program starts");
        let code = run.status.code().unwrap_or_else(|| panic!("{what}: {}", run.status));
        let stderr = String::from_utf8_lossy(&run.stderr);
        let mut expected = before;
        if code == 0 {
            let outcome: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON");
            let peak = outcome["memory"]["peak_bytes"].as_u64().expect("the kernel tells");
            assert!(peak <= BUDGET_BYTES, "{what}: {peak} bytes");
            expected.push("out.ply".into());
            expected.sort();
        } else {
            assert_eq!(stderr.lines().count(), 1, "{what}: {stderr:?}");
            assert!(stderr.starts_with("brickmend: "), "{what}: {stderr:?}");
        }
        assert_eq!(self.names(), expected, "{what}: left over");
        code
    }
}

const FACE: &str = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// A tetrahedron with corners at these coordinates.
fn tetrahedron(near: &str, far: &str) -> String {
    let (n, f) = (near, far);
    format!(
        "v {n} {n} {n}\nv {f} {n} {n}\nv {n} {f} {n}\nv {n} {n} {f}\n\
         f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
}

fn gzip(content: impl IntoIterator<Item = Vec<u8>>) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    content.into_iter().for_each(|block| encoder.write_all(&block).expect("in memory"));
    encoder.finish().expect("in memory")
}

#[test]
fn what_is_no_file_is_refused_at_once() {
    let folder = Case::new("folder.obj");
    std::fs::create_dir(&folder.input).expect("writable");
    assert_eq!(folder.run("a folder"), 65);
    let pipe = Case::new("pipe.obj");
    let made = Command::new("mkfifo").arg(&pipe.input).status().expect("mkfifo starts");
    assert!(made.success());
    assert_eq!(pipe.run("a pipe"), 65);
    let socket = Case::new("socket.obj");
    let _listener = UnixListener::bind(&socket.input).expect("a socket");
    assert_eq!(socket.run("a socket"), 65);
    for device in ["/dev/zero", "/dev/null", "/dev/full"] {
        let link = Case::new("device.obj");
        std::os::unix::fs::symlink(device, &link.input).expect("a link");
        assert_eq!(link.run(device), 65);
    }
    let looped = Case::new("loop.obj");
    std::os::unix::fs::symlink(&looped.input, &looped.input).expect("a link");
    assert_eq!(looped.run("a link to itself"), 65);
    assert_eq!(Case::new("missing.obj").run("a missing file"), 65);
}

#[test]
fn names_of_any_bytes_are_read_and_told_on_one_line() {
    let long = format!("{}.obj", "n".repeat(240));
    for name in [OsStr::from_bytes(b"a\xff\xfe.obj"), OsStr::new("a\nb\r.obj"), OsStr::new(&long)] {
        let what = name.to_string_lossy();
        assert_eq!(Case::holding(name, FACE.as_bytes()).run(&what), 0, "{what}");
        assert_eq!(Case::holding(name, b"").run(&what), 65, "{what}");
    }
}

#[test]
fn extreme_coordinates_are_repaired_or_refused() {
    for (near, far) in [
        ("0", "1e308"),
        ("-1e308", "1e308"),
        ("0", "5e-324"),
        ("1e-310", "3e-310"),
        ("0", "1e-200"),
        ("1e15", "1000000000000001"),
        ("0", "1e75"),
        ("7", "7"),
    ] {
        let what = format!("{near} to {far}");
        let code = Case::holding("a.obj", tetrahedron(near, far).as_bytes()).run(&what);
        assert!(matches!(code, 0 | 4 | 65), "{what}: {code}");
    }
    let mixed = format!("{FACE}v 1e308 -1e308 5e-324\nv nan inf 1\nf 1 2 5\nf 1 2 6\n");
    let code = Case::holding("a.obj", mixed.as_bytes()).run("mixed");
    assert!(matches!(code, 0 | 4 | 65), "mixed: {code}");
}

#[test]
fn few_and_no_triangles_have_an_answer() {
    for (what, text, codes) in [
        ("one triangle", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &[0, 4][..]),
        ("no triangle", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", &[65]),
        ("a point thrice", "v 1 1 1\nf 1 1 1\n", &[65]),
        ("only comments", "# nothing\n", &[65]),
    ] {
        let code = Case::holding("a.obj", text.as_bytes()).run(what);
        assert!(codes.contains(&code), "{what}: {code}");
    }
}

#[test]
fn a_million_triangles_in_one_place_are_one() {
    let mut stl = vec![b' '; 80];
    stl.extend(1_000_000_u32.to_le_bytes());
    let mut facet = [0; 50];
    for (at, x) in [(24, 1.0_f32), (40, 1.0)] {
        facet[at..at + 4].copy_from_slice(&x.to_le_bytes());
    }
    (0..1_000_000).for_each(|_| stl.extend(facet));
    let code = Case::holding("a.stl", &stl).run("a million sheets");
    assert!(matches!(code, 0 | 4), "{code}");
    let mut obj = String::from(FACE);
    (0..250_000).for_each(|_| obj.push_str("f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"));
    assert_eq!(Case::holding("a.obj", obj.as_bytes()).run("a million faces"), 0);
}

#[test]
fn promises_that_a_file_does_not_keep_are_refused() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let ply = |elements: &str| format!("ply\nformat ascii 1.0\n{elements}end_header\n0 0 0\n");
    let vertices = ply(&format!("element vertex 4000000000\n{xyz}"));
    let list = "property list int int vertex_indices\n";
    let negative = format!(
        "ply\nformat ascii 1.0\nelement vertex 1\n{xyz}element face 1\n{list}end_header\n0 0 0\n-3 0 0 0\n"
    );
    let mut binary = format!("ply\nformat binary_little_endian 1.0\nelement vertex 0\n{xyz}element face 1\nproperty list uint int vertex_indices\nend_header\n").into_bytes();
    binary.extend([255; 64]);
    let mut stl = vec![b' '; 80];
    stl.extend([255; 4]);
    stl.extend([0; 100]);
    for (name, content) in [
        ("a.ply", vertices.into_bytes()),
        ("b.ply", negative.into_bytes()),
        ("c.ply", binary),
        ("a.stl", stl),
        ("a.off", b"OFF 4000000000 4000000000 0\n0 0 0\n".to_vec()),
        ("b.off", b"OFF 1 1 0\n0 0 0\n4294967295 0 0\n".to_vec()),
        ("a.obj", b"v 0 0 0\nf 4000000000 -4000000000 1\n".to_vec()),
    ] {
        assert_eq!(Case::holding(name, &content).run(name), 65, "{name}");
    }
}

#[test]
fn lines_without_end_are_read_through_or_refused_in_little_memory() {
    let blank = vec![b' '; 64 << 20];
    for (what, head, fill, codes) in [
        ("blanks", FACE, &blank[..], &[0][..]),
        ("a word", "v 1 2 3\nf ", &vec![b'7'; 64 << 20][..], &[65]),
        ("a comment", "# ", &vec![b'x'; 64 << 20][..], &[65]),
    ] {
        let code = Case::holding("a.obj", &[head.as_bytes(), fill].concat()).run(what);
        assert!(codes.contains(&code), "{what}: {code}");
    }
}

#[test]
fn bombs_are_refused_before_they_burst() {
    let zeros = gzip((0..1024).map(|_| vec![0; 1 << 20]));
    assert_eq!(Case::holding("a.obj.gz", &zeros).run("a gigabyte of zeros"), 65);
    let head = FACE.as_bytes().to_vec();
    let lines = gzip(std::iter::once(head).chain((0..1024).map(|_| vec![b'\n'; 1 << 20])));
    assert_eq!(Case::holding("a.obj.gz", &lines).run("a gigabyte of lines"), 65);
    let nested = gzip([gzip([FACE.as_bytes().to_vec()])]);
    assert_eq!(Case::holding("a.obj.gz", &nested).run("packed twice"), 65);
    let empty = gzip([]);
    let members = empty.repeat((32 << 20) / empty.len());
    assert_eq!(Case::holding("a.obj.gz", &members).run("a million empty members"), 65);
    let whole = gzip([FACE.as_bytes().to_vec()]);
    assert_eq!(Case::holding("a.obj.gz", &whole).run("a packed model"), 0);
    for length in [1, 9, 10, whole.len() / 2, whole.len() - 1] {
        let cut = Case::holding("a.obj.gz", &whole[..length]);
        assert_eq!(cut.run(&format!("cut at {length}")), 65);
    }
}

#[test]
fn material_libraries_lead_nowhere_else() {
    let outside = TempDir::new().expect("a temporary folder");
    std::fs::write(outside.path().join("secret.mtl"), "newmtl m\nd 0\n").expect("writable");
    let absolute = outside.path().join("secret.mtl");
    let link = |case: &Case, target: &Path| {
        let name = case.folder.path().join("link.mtl");
        std::os::unix::fs::symlink(target, name).expect("a link");
    };
    for name in ["../secret.mtl", &absolute.to_string_lossy(), "link.mtl", "pipe.mtl", "."] {
        let text = format!("mtllib {name}\nusemtl m\n{FACE}");
        let case = Case::holding("a.obj", text.as_bytes());
        link(&case, &absolute);
        let pipe = case.folder.path().join("pipe.mtl");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo starts").success());
        // Transparent or not shows in no output yet; that it ends, and how, does.
        assert_eq!(case.run(name), 0, "{name}");
    }
}
