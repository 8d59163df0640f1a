//! Reading of regular files only: reading a pipe could block, and reading a device such as `/dev/zero` never ends.

use std::fs::{File, FileType};
use std::io::{self, ErrorKind, Read as _};
use std::os::unix::fs::FileTypeExt as _;
use std::path::Path;

use rustix::fs::{Mode, OFlags};

/// Maximum size of a settings file or a calibration, in bytes.
pub const SETTINGS: u64 = 64 << 20;
/// Maximum size of a picture file, in bytes.
pub const PICTURE: u64 = 512 << 20;
/// Maximum size of a model or network file, in bytes; ONNX files cannot be larger.
pub const MODEL: u64 = 2 << 30;
/// Maximum size of a file of results that is read at once, in bytes.
pub const RESULTS: u64 = 4 << 30;

/// Opens a regular file for reading; follows links.
///
/// # Errors
///
/// Returns errors of the operating system, and `InvalidInput` for a folder, a pipe, a socket, or a device. The function never blocks.
pub fn open(path: &Path) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let file = match rustix::fs::open(path, flags, Mode::empty()) {
        // The file is a socket, or a device without a driver.
        Err(rustix::io::Errno::NXIO) => return Err(not_regular("a socket or a device")),
        opened => File::from(opened?),
    };
    let kind = file.metadata()?.file_type();
    if !kind.is_file() {
        return Err(not_regular(name(kind)));
    }
    Ok(file)
}

/// Reads a regular file of at most `most` bytes.
///
/// # Errors
///
/// Fails like [`open`], and with `FileTooLarge` if there are more bytes.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let bytes = file.metadata()?.len();
    let mut content = Vec::new();
    if bytes <= most {
        content.reserve_exact(bytes as usize);
        file.take(most + 1).read_to_end(&mut content)?;
    }
    let bytes = bytes.max(content.len() as u64);
    if bytes > most {
        let text = format!("has {bytes} bytes, but at most {most} bytes are read from such a file");
        return Err(io::Error::new(ErrorKind::FileTooLarge, text));
    }
    Ok(content)
}

/// Works like [`read`], for text.
///
/// # Errors
///
/// Fails like [`read`], and with `InvalidData` if the file is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let text = String::from_utf8(read(path, most)?);
    text.map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
}

fn not_regular(what: &str) -> io::Error {
    let text = format!("is {what}, not a regular file");
    io::Error::new(ErrorKind::InvalidInput, text)
}

/// Returns the name of a kind of file.
fn name(kind: FileType) -> &'static str {
    if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::net::UnixListener;
    use std::path::PathBuf;

    use rustix::fs::{CWD, FileType, mknodat};

    use super::*;

    fn refused(path: &Path) -> String {
        read(path, 10).unwrap_err().to_string()
    }

    #[test]
    fn only_regular_files_are_read_and_nothing_blocks() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let socket = folder.path().join("socket");
        let _listener = UnixListener::bind(&socket).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        assert_eq!(refused(&pipe), "is a named pipe, not a regular file");
        assert_eq!(refused(&link), "is a named pipe, not a regular file");
        assert_eq!(refused(folder.path()), "is a folder, not a regular file");
        assert!(refused(&socket).contains("socket"));
        assert_eq!(
            refused(&PathBuf::from("/dev/zero")),
            "is a device, not a regular file"
        );
    }

    #[test]
    fn a_file_that_is_too_large_is_refused_with_its_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.toml");
        fs::write(&path, "0123456789").unwrap();
        assert_eq!(read(&path, 10).unwrap(), b"0123456789");
        fs::write(&path, "0123456789a").unwrap();
        let error = read(&path, 10).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        assert!(error.to_string().contains("11 bytes"), "{error}");
        // This file reports a size of 0, but has content.
        assert!(!read_text(Path::new("/proc/self/stat"), 1 << 20).unwrap().is_empty());
    }
}
