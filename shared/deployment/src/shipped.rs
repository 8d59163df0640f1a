//! Reserved names for a file that is built into Parallax, and for no file.

use std::path::{Path, PathBuf};

/// Reserved name for the built-in file. Use `./shipped` for a file with this name.
pub const SHIPPED: &str = "shipped";

/// Returns true if the name means the built-in file.
pub fn is_shipped(file: &Path) -> bool {
    file == Path::new(SHIPPED)
}

/// Reserved name for no file. Use `./none` for a file with this name.
pub const NONE: &str = "none";

/// Returns true if the name means no file.
pub fn is_none(file: &Path) -> bool {
    file == Path::new(NONE)
}

/// Resolves a relative path against `base`; reserved names are returned unchanged.
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
    fn the_word_alone_selects_the_included_file_and_a_path_selects_a_file() {
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
