//! Relative addresses of files, whatever bytes their names have.

use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

/// A relative path as an address: all bytes but the plainest are escaped (RFC 3986, section 2.1), and
/// a colon in the first name makes no scheme of it.
pub(crate) fn address_of(relative: &Path) -> String {
    let mut address = String::new();
    for byte in relative.as_os_str().as_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' | b'~' => {
                address.push(char::from(*byte));
            }
            byte => address.push_str(&format!("%{byte:02X}")),
        }
    }
    address
}

/// The way from one folder to another; both are absolute and without links.
pub(crate) fn way_between(from: &Path, to: &Path) -> PathBuf {
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let ups = from.components().skip(shared).map(|_| Component::ParentDir);
    ups.chain(to.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsStr;

    #[test]
    fn addresses_hold_no_markup_and_no_scheme() {
        let path = Path::new(OsStr::from_bytes(b"java:x/\xff \"<a>?#%.obj"));
        assert_eq!(address_of(path), "java%3Ax/%FF%20%22%3Ca%3E%3F%23%25.obj");
    }

    #[test]
    fn ways_go_up_and_down() {
        let way = |from: &str, to: &str| way_between(Path::new(from), Path::new(to));
        assert_eq!(way("/a/b", "/a/c/d"), Path::new("../c/d"));
        assert_eq!(way("/a", "/a/b"), Path::new("b"));
        assert_eq!(way("/a/b", "/a/b"), Path::new(""));
    }
}
