//! Names of the parts of a package, in the one spelling that they are compared in.
//!
//! OPC compares without regard to case; a name may be written with or without its leading slash,
//! with percent escapes, with backslashes (some zip writers), with `.` and `..`. No name is ever
//! used as a path of the disk. Memory: one name.

/// The spelling that all spellings of a name share.
pub(super) fn part_key(name: &str) -> String {
    let plain = unescaped(name).to_ascii_lowercase().replace('\\', "/");
    let mut segments = Vec::new();
    for segment in plain.split('/') {
        match segment {
            "" | "." => {}
            // Above the root there is nothing else.
            ".." => drop(segments.pop()),
            segment => segments.push(segment),
        }
    }
    segments.join("/")
}

/// The name with its percent escapes replaced.
fn unescaped(name: &str) -> String {
    let bytes = name.as_bytes();
    let mut plain = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let digit = |at: usize| char::from(*bytes.get(at)?).to_digit(16);
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                plain.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                plain.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&plain).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_spellings_of_a_name_are_one() {
        for name in [
            "3D/3dmodel.model",
            "/3D/3dmodel.model",
            "3d\\3DMODEL.MODEL",
            "/3D/./x/../3dmodel.model",
            "//%33D/3dmodel%2Emodel",
            "../../3D/3dmodel.model",
        ] {
            assert_eq!(part_key(name), "3d/3dmodel.model", "{name}");
        }
        assert_eq!(part_key("a%2"), "a%2");
        assert_eq!(part_key("a%zz%c3%a4"), "a%zz\u{e4}");
        assert_eq!(part_key("/"), "");
    }
}
