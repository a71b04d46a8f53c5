//! Where the result of a model goes: the tree of the models, mirrored.

use std::path::{Path, PathBuf};

use crate::io::{Format, detect, format_of_name, unpacked_name};

/// The format of the result of the model at `path`: the one asked for, else its own.
#[must_use]
pub fn result_format(path: &Path, asked: Option<Format>) -> Option<Format> {
    asked.or_else(|| format_of_name(path)).or_else(|| detect(path).ok())
}

/// The name that a result should have: that of the model, with another extension if the format is
/// another one. Packed models have results that are not packed.
#[must_use]
pub fn wished_name(relative: &Path, format: Format) -> PathBuf {
    let name = unpacked_name(relative);
    if format_of_name(&name) == Some(format) && !has_extension(&name, "gltf") {
        name
    } else if format_of_name(&name).is_some() {
        name.with_extension(format.extension())
    } else {
        appended(&name, format)
    }
}

/// The name that tells a result apart from those of models of the same name but for the extension.
#[must_use]
pub fn distinct_name(relative: &Path, format: Format) -> PathBuf {
    appended(relative, format)
}

fn has_extension(name: &Path, extension: &str) -> bool {
    name.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

fn appended(name: &Path, format: Format) -> PathBuf {
    let mut name = name.as_os_str().to_owned();
    name.push(".");
    name.push(format.extension());
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_mirror_those_of_the_models() {
        let cases = [
            ("a/chair.OBJ", Format::Obj, "a/chair.OBJ"),
            ("a/chair.obj.gz", Format::Obj, "a/chair.obj"),
            ("chair.gltf", Format::Glb, "chair.glb"),
            ("chair.v2.stl", Format::Ply, "chair.v2.ply"),
            ("chair", Format::Ply, "chair.ply"),
            ("chair.off", Format::ThreeMf, "chair.3mf"),
        ];
        for (model, format, result) in cases {
            assert_eq!(wished_name(Path::new(model), format), Path::new(result));
        }
        assert_eq!(distinct_name(Path::new("a/b.obj"), Format::Glb), Path::new("a/b.obj.glb"));
    }
}
