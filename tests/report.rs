//! The pages of a report, as text and, where a browser is named, clicked through.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use brickmend::mesh::shapes::{cuboid, sphere};
use tempfile::TempDir;

use crate::support::obj::unwelded_obj;
use crate::support::page::{Page, file_at};

/// Names that would like to be something else.
const HOSTILE: [&[u8]; 6] = [
    b"<script>alert(1)</script>.obj",
    b"\"onerror=\"alert(2)\" x='.obj",
    b"a&lt;b & c;%41.obj",
    b"https:/evil.example/x.obj",
    b"tab\tline\nend\xff\xe2\x80\xae.obj",
    b"-->]]>{{}}.obj",
];

/// A tetrahedron, closed and outward.
const SOUND: &str = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

struct Library {
    folder: TempDir,
}

impl Library {
    fn new() -> Self {
        let library = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        library.write("b/sound.off".as_ref(), SOUND);
        library.write("b/torn.obj".as_ref(), "v 0 0 0\nf 1 2 3 <b>\n");
        library
    }

    fn hostile() -> Self {
        let library = Self::new();
        let open = &cuboid([0.0; 3], [1.0, 2.0, 3.0])[2..];
        for name in HOSTILE {
            library.write(OsStr::from_bytes(name).as_ref(), &obj_of(open));
        }
        library
    }

    fn models(&self) -> PathBuf {
        self.folder.path().join("models")
    }

    fn results(&self) -> PathBuf {
        self.folder.path().join("results")
    }

    fn index(&self) -> PathBuf {
        self.results().join(".brickmend/report/index.html")
    }

    fn write(&self, relative: &Path, text: &str) {
        let path = self.models().join(relative);
        std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
        std::fs::write(path, text).expect("writable");
    }

    fn batch(&self, extra: &[&str]) -> i32 {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.arg("batch").arg(self.models()).arg("-o").arg(self.results());
        command.args(["--depth", "5", "--max-memory", "256MiB", "--jobs", "2", "-q"]).args(extra);
        code_of(&mut command)
    }

    fn status(&self) -> serde_json::Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        let told = command.arg("status").arg(self.results()).arg("--json").output();
        serde_json::from_slice(&told.expect("the program starts").stdout).expect("JSON")
    }
}

fn code_of(command: &mut Command) -> i32 {
    let run = command.output().expect("the program starts");
    let told = String::from_utf8_lossy(&run.stderr).into_owned();
    run.status.code().unwrap_or_else(|| panic!("{told}"))
}

fn obj_of(triangles: &[[[f64; 3]; 3]]) -> String {
    format!("o <part>\"&'\n{}", unwelded_obj(triangles))
}

/// Every link and picture of the page leads to a file that is there.
fn assert_leads_somewhere(page: &Page, path: &Path) {
    let folder = path.parent().expect("in a folder");
    for address in page.addresses() {
        let is_there = address.starts_with("data:") || file_at(folder, address).is_file();
        assert!(is_there, "{address} leads nowhere");
    }
}

fn models_in(summary: &serde_json::Value, key: &str, word: &str) -> u64 {
    let states = summary["states"].as_array().expect("a list");
    let of_word = states.iter().filter(|count| count[key] == word);
    of_word.map(|count| count["models"].as_u64().expect("a number")).sum()
}

#[test]
fn the_page_of_a_model_whose_parts_were_kept_apart_lists_them() {
    let library = Library { folder: tempfile::tempdir().expect("a temporary folder") };
    // The second part is a sheet, at which a person should look.
    let mut text = obj_of(&cuboid([0.0; 3], [1.0, 1.0, 0.5]));
    text.push_str("o leg & foot\nv 0 0 2\nv 1 0 2\nv 0 1 2\nf -3 -2 -1\n");
    library.write("table.obj".as_ref(), &text);
    assert_eq!(library.batch(&["--parts", "separate"]), 0);
    let page = library.results().join(".brickmend/report/models/1.html");
    let text = std::fs::read_to_string(page).expect("a page");
    let list = text.split_once("id=\"parts\"").expect("a list of parts").1;
    let list = list.split_once("</section>").expect("it ends").0;
    let at = |word: &str| list.find(word).unwrap_or_else(|| panic!("{word}: {list}"));
    assert!(at("leg &amp; foot") < at("&lt;part&gt;"), "what is worth a look first: {list}");
    assert!(at("is-review") < at("is-pass"), "{list}");
    assert!(!text.contains("<part>"), "names become no markup");
}

#[test]
fn the_page_of_a_catalogue_tells_what_the_journal_knows() {
    let library = Library::hostile();
    assert_eq!(library.batch(&[]), 3, "one model is none");
    let index = library.index();
    let page = Page::read(&index);
    assert_leads_somewhere(&page, &index);
    let summary = library.status();
    let data = page.data("models-data");
    let models = data["models"].as_array().expect("a list");
    assert_eq!(models.len(), HOSTILE.len() + 2);
    assert_eq!(page.card("Models"), models.len().to_string());
    let results: u64 =
        ["copied", "repaired", "degraded"].iter().map(|s| models_in(&summary, "state", s)).sum();
    assert_eq!(page.card("With a result"), results.to_string());
    assert_eq!(page.card("Failed"), models_in(&summary, "state", "failed").to_string());
    assert_eq!(page.card("To look at"), models_in(&summary, "verdict", "review").to_string());
    for word in ["pass", "review", "failed", "copied"] {
        let listed = models.iter().filter(|model| model["s"] == word).count() as u64;
        let (key, value) = match word {
            "pass" | "review" => ("verdict", word),
            state => ("state", state),
        };
        assert_eq!(listed, models_in(&summary, key, value), "{word}");
    }
    // The rows that stand there as text are those of the data.
    let rows = page.all("td").filter(|cell| cell.attribute("data-name") == Some("Size")).count();
    assert_eq!(rows, models.len());
    let names: Vec<&str> = page.all("bdi").map(|name| name.text.as_str()).collect();
    for model in models {
        let name = model["n"].as_str().expect("text");
        assert!(names.contains(&name), "{name}");
        assert!(!name.contains(|c: char| c.is_control() || c == '\u{202e}'), "{name:?}");
    }
    assert!(names.contains(&"<script>alert(1)</script>.obj"), "{names:?}");
    let failures = page.elements.iter().find(|e| e.attribute("id") == Some("failures"));
    assert!(failures.expect("there are some").text.contains("input: 1 models"));
}

#[test]
fn every_result_has_a_page_that_reads_as_it_should() {
    let library = Library::hostile();
    library.batch(&[]);
    let data = Page::read(&library.index()).data("models-data");
    let folder = library.results().join(".brickmend/report");
    let mut pages = 0;
    for model in data["models"].as_array().expect("a list") {
        let path = folder.join(format!("models/{}.html", model["i"]));
        if model["s"] == "failed" {
            assert!(!path.exists(), "there is nothing to show");
            continue;
        }
        assert_eq!(model["p"], 3, "a page and pictures: {model}");
        pages += 1;
        let page = Page::read(&path);
        assert_leads_somewhere(&page, &path);
        let title = &page.all("h1").next().expect("a heading").text;
        assert_eq!(title, model["n"].as_str().expect("text"));
        let badge = page.all("span").find(|span| span.attribute("class").is_some());
        assert_eq!(badge.expect("a badge").text, model["s"].as_str().expect("text"));
        if model["s"] != "copied" {
            let json = &page.all("pre").next().expect("all numbers").text;
            let outcome: serde_json::Value = serde_json::from_str(json).expect("JSON");
            assert_eq!(outcome["input"]["triangles"], model["f"]);
            assert_eq!(outcome["output"]["proof"]["triangles"], model["a"]);
            assert!(outcome["stages"]["contour"]["resident_bytes"].as_u64() > Some(0));
            assert!(page.all("svg").next().is_some(), "a plot");
        }
        let meshes = page.data("meshes");
        assert_ne!(meshes["before"]["triangles"], "", "a mesh to turn");
        assert_ne!(meshes["after"]["triangles"], "", "a mesh to turn");
    }
    assert_eq!(pages, HOSTILE.len() + 1);
}

#[test]
fn a_page_elsewhere_still_finds_results_and_pictures() {
    let library = Library::new();
    library.batch(&[]);
    let elsewhere = library.folder.path().join("some where/page.html");
    std::fs::create_dir(elsewhere.parent().expect("in a folder")).expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("report").arg(library.results()).arg("-o").arg(&elsewhere);
    assert_eq!(code_of(&mut command), 0);
    let page = Page::read(&elsewhere);
    assert_leads_somewhere(&page, &elsewhere);
    assert!(page.all("img").next().is_some(), "there are pictures");
    // From the journal alone: the models may be gone.
    let here = std::fs::read(library.index()).expect("a page");
    std::fs::remove_dir_all(library.models()).expect("removable");
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    assert_eq!(code_of(command.arg("report").arg(library.results())), 0);
    assert_eq!(std::fs::read(library.index()).expect("a page"), here, "the same page");
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    assert_eq!(code_of(command.arg("report").arg(library.folder.path())), 2, "no journal there");
}

#[test]
fn what_is_not_wanted_is_not_drawn_and_what_is_old_goes() {
    let library = Library::new();
    let pages = || {
        let data = Page::read(&library.index()).data("models-data");
        let models = data["models"].as_array().expect("a list").clone();
        models.iter().map(|model| model["p"].as_u64().expect("a number")).max()
    };
    library.batch(&["--pages", "thumbnails"]);
    assert_eq!(pages(), Some(2));
    library.batch(&["--retry", "all"]);
    assert_eq!(pages(), Some(3));
    library.batch(&["--no-pages", "--retry", "all"]);
    assert_eq!(pages(), Some(0));
    library.batch(&["--retry", "all"]);
    assert_eq!(pages(), Some(3));
    library.write("b/sound.off".as_ref(), "OFF\nnone");
    library.batch(&[]);
    assert_eq!(pages(), Some(0), "a failed model has no page");
}

#[test]
fn the_page_of_one_repair_holds_all_that_it_shows() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = folder.path().join("<b>ball&.obj");
    std::fs::write(&input, obj_of(&sphere([0.0; 3], 1.0, 8)[1..])).expect("writable");
    let (output, path) = (folder.path().join("out.ply"), folder.path().join("page.html"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("repair").arg(&input).arg("-o").arg(&output).arg("--report").arg(&path);
    assert_eq!(code_of(command.args(["--depth", "6", "-q"])), 0);
    let page = Page::read(&path);
    assert!(page.addresses().iter().all(|address| address.starts_with("data:")), "alone");
    assert_eq!(page.all("h1").next().expect("a heading").text, "<b>ball&.obj");
    assert_eq!(page.card("Depth"), "6");
    assert_eq!(page.all("img").count(), 3, "before, after, and the map");
    let meshes = page.data("meshes");
    let bytes = |text: &serde_json::Value| {
        let text = text.as_str().expect("base64");
        text.len() / 4 * 3 - text.bytes().rev().take_while(|byte| *byte == b'=').count()
    };
    let vertices = bytes(&meshes["after"]["vertices"]) / 6;
    assert!(vertices > 50, "{vertices} vertices");
    assert_eq!(bytes(&meshes["deviation"]), vertices, "each vertex has a place on the scale");
    let marks: Vec<f64> = page.all("span").filter_map(|mark| mark.text.parse().ok()).collect();
    assert_eq!(marks.len(), 8, "a scale of four numbers, twice");
    assert!(marks[..4].is_sorted() && marks[0] > 0.0, "{marks:?}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("repair").arg(&input).arg("-o").arg(&output).arg("--report").arg(&path);
    assert_eq!(code_of(command.args(["--depth", "6", "-q", "--no-deviation"])), 0);
    let page = Page::read(&path);
    assert_eq!(page.all("img").count(), 2, "no map where nothing is measured");
    assert!(page.data("meshes").get("deviation").is_none());
}

#[test]
fn a_long_table_ends_early_as_text_and_is_whole_as_data() {
    let library = Library::new();
    library.batch(&["--no-pages"]);
    let journal = library.results().join(".brickmend/journal.sqlite");
    let more = "WITH RECURSIVE number (i) AS (VALUES (1) UNION ALL SELECT i + 1 FROM number WHERE i < 400)
        INSERT INTO model (path, name, output, format, run_id, state, input_bytes, input_mtime_ns,
                           input_ctime_ns, input_inode, settings_digest)
        SELECT CAST('m' || i AS BLOB), 'm' || i, CAST('m' || i AS BLOB), 'ply', 1, 'pending', i, 0, 0, 0,
               x'00' FROM number";
    let connection = rusqlite::Connection::open(journal).expect("a journal");
    connection.execute(more, ()).expect("it may be written");
    drop(connection);
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    assert_eq!(code_of(command.arg("report").arg(library.results())), 0);
    let page = Page::read(&library.index());
    assert_eq!(page.card("Models"), "402");
    assert_eq!(page.data("models-data")["models"].as_array().map(Vec::len), Some(402));
    let rows = page.all("td").filter(|cell| cell.attribute("data-name") == Some("Size")).count();
    assert_eq!(rows, 300);
    let said = page.all("p").any(|p| p.text.contains("the table ends here: 300 of 402 models"));
    assert!(said, "what is not shown is said");
}

#[test]
fn a_person_can_use_the_pages() {
    let Ok(browser) = std::env::var("BRICKMEND_CHROMIUM") else {
        println!("skipped: BRICKMEND_CHROMIUM names no browser");
        return;
    };
    let library = Library::hostile();
    library.batch(&[]);
    let model = library.results().join(".brickmend/report/models/3.html");
    // The page of one repair has a map, those of a batch have none.
    let alone = library.folder.path().join("alone.html");
    let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
    command.arg("repair").arg(library.models().join("b/sound.off")).args(["--depth", "5", "-q"]);
    command.arg("-o").arg(library.folder.path().join("alone.ply")).arg("--report").arg(&alone);
    assert_eq!(code_of(&mut command), 0);
    let python = std::env::var("BRICKMEND_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/click_report.py");
    for page in [model, alone] {
        let mut command = Command::new(&python);
        command.arg(&script).arg("--index").arg(library.index()).arg("--page").arg(page);
        let run = command.env("BRICKMEND_CHROMIUM", &browser).output().expect("python starts");
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    }
}
