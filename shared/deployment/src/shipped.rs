//! The words that stand for a file which is built into Parallax, and for no file.

use std::path::{Path, PathBuf};

/// The word that stands for a file that ships, where a file can be named; `./shipped` is a file of that name.
pub const SHIPPED: &str = "shipped";

/// Returns true if a name is that of a file that ships.
pub fn is_shipped(file: &Path) -> bool {
    file == Path::new(SHIPPED)
}

/// The word that stands for no file, where there is one without it; `./none` is a file of that name.
pub const NONE: &str = "none";

/// Returns true if a name stands for no file.
pub fn is_none(file: &Path) -> bool {
    file == Path::new(NONE)
}

/// A name with relative paths taken as relative to `base`.
pub fn relative_to(file: &Path, base: &Path) -> PathBuf {
    if is_shipped(file) {
        return file.to_owned();
    }
    base.join(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_alone_is_built_in_and_a_path_is_a_path() {
        let base = Path::new("/room");
        assert_eq!(relative_to(Path::new(SHIPPED), base), Path::new(SHIPPED));
        for (named, file) in [
            ("./shipped", "/room/./shipped"),
            ("a/shipped", "/room/a/shipped"),
            ("a.onnx", "/room/a.onnx"),
        ] {
            assert!(!is_shipped(Path::new(named)), "{named}");
            assert_eq!(relative_to(Path::new(named), base), Path::new(file));
        }
    }
}
