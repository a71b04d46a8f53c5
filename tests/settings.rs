//! Settings from the command line, the environment and the file: which one holds, and what is refused.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// A folder with a file of settings.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new(settings: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("brickmend.toml"), settings).expect("writable");
        Self { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Runs the program here; exit code, stdout, stderr.
    fn run(&self, arguments: &[&str], environment: &[(&str, &str)]) -> (i32, String, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brickmend"));
        command.current_dir(self.path()).args(arguments);
        for (name, value) in environment {
            command.env(name, value);
        }
        let run = command.output().expect("the program starts");
        let text = |bytes| String::from_utf8(bytes).expect("text");
        (run.status.code().expect("no signal"), text(run.stdout), text(run.stderr))
    }

    /// Value, origin and place of a setting, as `config` tells it.
    fn setting(
        &self,
        key: &str,
        arguments: &[&str],
        environment: &[(&str, &str)],
    ) -> (String, String, String) {
        let mut words = vec!["config", "--json"];
        words.extend(arguments);
        let (code, out, err) = self.run(&words, environment);
        assert_eq!(code, 0, "{err}");
        let told: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        let settings = told["settings"].as_array().expect("a list");
        let setting = settings.iter().find(|setting| setting["key"] == key).expect("a setting");
        let values = setting["values"].as_array().expect("a list");
        let values: Vec<&str> = values.iter().map(|value| value.as_str().expect("text")).collect();
        let word = |field: &str| setting[field].as_str().expect("text").to_owned();
        (values.join(" "), word("origin"), word("place"))
    }
}

fn told(value: &str, origin: &str, place: &str) -> (String, String, String) {
    (value.to_owned(), origin.to_owned(), place.to_owned())
}

#[test]
fn flags_hold_over_the_environment_that_over_the_file_and_that_over_defaults() {
    let place = Place::new("# nightly\ndepth = 9\nmax-memory = \"2GiB\"\nall = true\n");
    let depth =
        |flags: &[&str], environment: &[(&str, &str)]| place.setting("depth", flags, environment);
    let variable = [("BRICKMEND_DEPTH", "8")];
    assert_eq!(depth(&["--depth", "7"], &variable), told("7", "flag", "flag"));
    assert_eq!(depth(&[], &variable), told("8", "environment", "BRICKMEND_DEPTH"));
    assert_eq!(depth(&[], &[]), told("9", "file", "brickmend.toml:2"));
    assert_eq!(place.setting("crease", &[], &[]), told("12", "default", "default"));
    assert_eq!(place.setting("max-memory", &[], &[]), told("2GiB", "file", "brickmend.toml:3"));
    assert_eq!(place.setting("all", &[], &[]), told("true", "file", "brickmend.toml:4"));
    let off = [("BRICKMEND_ALL", "false")];
    assert_eq!(place.setting("all", &[], &off), told("false", "environment", "BRICKMEND_ALL"));
}

#[test]
fn what_stands_for_the_same_choice_replaces_it() {
    let place = Place::new("depth = 9\n");
    let flags = ["--tolerance", "0.5"];
    assert_eq!(place.setting("depth", &flags, &[]), told("", "default", "default"));
    assert_eq!(place.setting("tolerance", &flags, &[]), told("0.5", "flag", "flag"));
    let variable = [("BRICKMEND_TOLERANCE", "0.1%")];
    assert_eq!(place.setting("depth", &[], &variable).1, "default");
    assert_eq!(place.setting("tolerance", &[], &variable).0, "0.1%");
}

#[test]
fn a_repair_does_as_the_file_says() {
    let place = Place::new("depth = 5\nthreads = 1\n");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/models/cube_binary.stl");
    let model = model.to_str().expect("text");
    let depth = |flags: &[&str]| {
        let mut words = vec!["repair", model, "-o", "out.ply", "--json", "--fresh"];
        words.extend(flags);
        let (code, out, err) = place.run(&words, &[]);
        assert_eq!(code, 0, "{err}");
        let outcome: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        outcome["grid"]["depth"].as_u64().expect("a number")
    };
    assert_eq!(depth(&[]), 5);
    assert_eq!(depth(&["--depth", "6"]), 6);
    std::fs::write(place.path().join("other.toml"), "depth = 4").expect("writable");
    assert_eq!(depth(&["--config", "other.toml"]), 4);
    // An inspection reads none of what is a repair's.
    std::fs::write(place.path().join("other.toml"), "thin = \"drop\"").expect("writable");
    let (code, _, err) = place.run(&["inspect", model, "--config", "other.toml"], &[]);
    assert_eq!(code, 0, "{err}");
}

/// Refused with 2, in one line that has these words.
fn check_refused(settings: &str, words: &[&str]) {
    let place = Place::new(settings);
    let (code, out, err) = place.run(&["config"], &[]);
    assert_eq!((code, out.as_str()), (2, ""), "{settings}: {err}");
    assert_eq!(err.trim_end().lines().count(), 1, "{err}");
    for word in words {
        assert!(err.contains(word), "{word}: {err}");
    }
}

#[test]
fn what_means_nothing_is_refused_with_its_line() {
    check_refused("\ndept = 9\n", &["brickmend.toml:2:", "dept;", "did you mean depth?"]);
    check_refused("max_memory = \"1GiB\"\n", &["brickmend.toml:1:", "did you mean max-memory?"]);
    check_refused("zzz = 1\n", &["brickmend.toml:1: no setting is called zzz\n"]);
    check_refused("depth = 9\ndepth = 8\n", &["brickmend.toml:2:"]);
    check_refused("depth = \n", &["brickmend.toml:1:"]);
    check_refused("jobs = 2\n\ndepth = 99\n", &["brickmend.toml:3:", "99", "4 to 15"]);
    check_refused("sheets = \"burn\"\n", &["brickmend.toml:1:", "burn", "thicken"]);
    check_refused("depth = [1]\n", &["brickmend.toml:1:", "expected a text"]);
    check_refused("all = \"perhaps\"\n", &["brickmend.toml:1:", "perhaps"]);
    check_refused("folder = 3\n", &["brickmend.toml:1:", "[[folder]]"]);
    check_refused("[[folder]]\ndepth = 9\n", &["brickmend.toml:1:", "match ="]);
    check_refused(
        "[[folder]]\nmatch = \"a/**\"\njobs = 9\n",
        &["brickmend.toml:3:", "jobs is the same for all folders"],
    );
    check_refused(
        "[[folder]]\nmatch = \"a/**\"\ndepth = 99\n",
        &["brickmend.toml:3 for a/**:", "4 to 15"],
    );
    check_refused("[[folder]]\nmatch = \"a[\"\n", &["brickmend.toml:2:", "a["]);
    let place = Place::new("");
    let (code, _, err) = place.run(&["config"], &[("BRICKMEND_DEPTH", "deep")]);
    assert_eq!(code, 2);
    assert!(err.contains("BRICKMEND_DEPTH:") && err.contains("deep"), "{err}");
    let (code, _, err) = place.run(&["config", "--config", "gone.toml"], &[]);
    assert!(code == 2 && err.contains("gone.toml"), "{err}");
}

#[test]
fn folders_differ_and_the_later_one_holds() {
    let place = Place::new(
        "depth = 5\n[[folder]]\nmatch = \"thin/**\"\ndepth = 6\n[[folder]]\nmatch = [\"*.stl\"]\n\
         tolerance = \"1%\"\nformat = \"ply\"\n",
    );
    let of = |key: &str, model: &str| place.setting(key, &["--model", model], &[]);
    assert_eq!(of("depth", "other/a.obj"), told("5", "file", "brickmend.toml:1"));
    assert_eq!(of("depth", "thin/a.obj"), told("6", "file", "brickmend.toml:4 for thin/**"));
    assert_eq!(of("depth", "thin/a.stl").1, "default", "the tolerance replaces it");
    assert_eq!(of("tolerance", "thin/a.stl").0, "1%");
    let flags = ["--model", "thin/a.stl", "--depth", "7"];
    assert_eq!(place.setting("depth", &flags, &[]), told("7", "flag", "flag"));
    assert_eq!(place.setting("tolerance", &flags, &[]).1, "default");
}

#[test]
fn a_batch_repairs_each_folder_as_it_should_and_anew_where_that_changes() {
    let folders =
        |thin: u32| format!("depth = 5\n[[folder]]\nmatch = \"thin/**\"\ndepth = {thin}\n");
    let place = Place::new(&folders(6));
    let cube = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/models/cube_binary.stl");
    for name in ["models/thin/a.stl", "models/thick/b.stl"] {
        let path = place.path().join(name);
        std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
        std::fs::copy(&cube, path).expect("copied");
    }
    let batch = || {
        let words = ["batch", "models", "-o", "results", "--all", "-q", "--no-pages"];
        let (code, _, err) = place.run(&words, &[("BRICKMEND_MAX_MEMORY", "256MiB")]);
        assert_eq!(code, 0, "{err}");
    };
    let attempts = |model: &str| {
        let (_, out, _) = place.run(&["status", "results", "--json", "--why", model], &[]);
        let told: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        told["attempts"].as_array().map_or(0, Vec::len)
    };
    let size = |name: &str| std::fs::metadata(place.path().join(name)).expect("a result").len();
    batch();
    assert_eq!((attempts("thin/a.stl"), attempts("thick/b.stl")), (1, 1));
    let sizes = (size("results/thin/a.stl"), size("results/thick/b.stl"));
    batch();
    assert_eq!((attempts("thin/a.stl"), attempts("thick/b.stl")), (1, 1));
    std::fs::write(place.path().join("brickmend.toml"), folders(4)).expect("writable");
    batch();
    assert_eq!((attempts("thin/a.stl"), attempts("thick/b.stl")), (2, 1), "only what it is about");
    assert_eq!(size("results/thick/b.stl"), sizes.1);
}

#[test]
fn completions_and_the_manual_name_every_command() {
    let place = Place::new("");
    let commands = ["repair", "inspect", "batch", "status", "report", "estimate", "config", "man"];
    for shell in ["bash", "zsh", "fish"] {
        let (code, out, err) = place.run(&["completions", shell], &[]);
        assert_eq!(code, 0, "{err}");
        assert!(commands.iter().all(|command| out.contains(command)), "{shell}");
    }
    let (code, out, _) = place.run(&["man"], &[]);
    assert!(code == 0 && out.contains(".TH brickmend 1"), "{out:.200}");
    let (code, _, err) = place.run(&["man", "--out", "pages"], &[]);
    assert_eq!(code, 0, "{err}");
    for command in commands {
        let path = place.path().join(format!("pages/brickmend-{command}.1"));
        let text = std::fs::read_to_string(&path).expect("a page");
        assert!(text.contains(&format!(".TH brickmend-{command} 1")), "{text:.200}");
    }
    assert!(!place.path().join("pages/brickmend-worker.1").exists(), "it is no command of people");
    std::fs::write(place.path().join("file"), "").expect("writable");
    let (code, _, err) = place.run(&["man", "--out", "file"], &[]);
    assert_eq!(code, 5, "{err}");
}

#[test]
fn a_time_of_the_day_that_is_none_is_refused() {
    let place = Place::new("");
    let (code, _, err) = place.run(&["batch", "models", "-o", "results", "--until", "26:00"], &[]);
    assert!(code == 2 && err.contains("26:00") && err.contains("such as 06:00"), "{err}");
    assert_eq!(place.setting("until", &["--until", "6:00"], &[]).0, "6:00");
}
