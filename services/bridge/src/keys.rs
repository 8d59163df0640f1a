//! The keys of the hosts: one certificate authority, and a certificate with its key for each host.

use std::path::{Path, PathBuf};

/// The files that a host needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyFiles {
    /// Certificate of the authority.
    pub authority: PathBuf,
    /// Certificate of this host.
    pub certificate: PathBuf,
    /// Key of this host's certificate.
    pub key: PathBuf,
}

/// Error if keys cannot be created or used.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// A file is missing.
    #[error("{0} does not exist")]
    Missing(PathBuf),
    /// A key file already exists.
    #[error(
        "{0} already exists, and is not replaced: hosts with the old keys would no longer be accepted"
    )]
    Exists(PathBuf),
    /// A file cannot be written.
    #[error("cannot write {file}")]
    Write {
        /// Path of the file.
        file: PathBuf,
        /// Error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// A certificate cannot be created.
    #[error("cannot create the certificate of {host}: {message}")]
    Make {
        /// Name of the host.
        host: String,
        /// Reason for the failure.
        message: String,
    },
    /// This build cannot create keys.
    #[error("this build does not support hosts: build with `--features hosts`")]
    NotBuilt,
}

impl KeyFiles {
    /// Returns the files of a host in a folder, as [`make_keys`] writes them.
    ///
    /// # Errors
    ///
    /// Fails with [`KeyError::Missing`] if a file does not exist.
    pub fn find(folder: &Path, host: &str) -> Result<Self, KeyError> {
        let files = Self {
            authority: folder.join("ca.pem"),
            certificate: folder.join(format!("{host}.pem")),
            key: folder.join(format!("{host}.key")),
        };
        let all = [&files.authority, &files.certificate, &files.key];
        let missing = all.into_iter().find(|file| !file.is_file()).cloned();
        match missing {
            Some(missing) => Err(KeyError::Missing(missing)),
            None => Ok(files),
        }
    }
}

/// Creates an authority, and a certificate with its key for every host, in a folder: `ca.pem`, `ca.key`, `HOST.pem`, `HOST.key`. Only the
/// user can read the keys. Existing files are not replaced.
///
/// * `hosts`: names of the hosts, each with the names or addresses at which other hosts reach it.
///
/// # Errors
///
/// Fails with [`KeyError`] if a file exists or cannot be written.
#[cfg(feature = "zenoh")]
pub fn make_keys(folder: &Path, hosts: &[(String, Vec<String>)]) -> Result<Vec<PathBuf>, KeyError> {
    use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};

    let file = |name: &str, ending: &str| folder.join(format!("{name}.{ending}"));
    let names = || core::iter::once("ca").chain(hosts.iter().map(|host| host.0.as_str()));
    let mut all = names().flat_map(|name| [file(name, "pem"), file(name, "key")]);
    if let Some(exists) = all.find(|file| file.exists()) {
        return Err(KeyError::Exists(exists));
    }
    let failed = |host: &str, error: &dyn core::fmt::Display| KeyError::Make {
        host: host.to_owned(),
        message: error.to_string(),
    };
    let make = |host: &str, names: Vec<String>| {
        let mut params = CertificateParams::new(names).map_err(|error| failed(host, &error))?;
        params.distinguished_name.push(DnType::CommonName, host);
        Ok::<_, KeyError>(params)
    };
    let mut params = make("Parallax hosts", Vec::new())?;
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let key = KeyPair::generate().map_err(|error| failed("ca", &error))?;
    let authority = params.self_signed(&key).map_err(|error| failed("ca", &error))?;
    let mut files = vec![
        (file("ca", "pem"), authority.pem()),
        (file("ca", "key"), key.serialize_pem()),
    ];
    let issuer = Issuer::new(params, key);
    for (host, names) in hosts {
        let key = KeyPair::generate().map_err(|error| failed(host, &error))?;
        let params = make(
            host,
            [host.clone()].into_iter().chain(names.clone()).collect(),
        )?;
        let signed = params.signed_by(&key, &issuer);
        let signed = signed.map_err(|error| failed(host, &error))?;
        files.push((file(host, "pem"), signed.pem()));
        files.push((file(host, "key"), key.serialize_pem()));
    }
    for (file, text) in &files {
        write_private(file, text)?;
    }
    Ok(files.into_iter().map(|file| file.0).collect())
}

/// Fails, because keys need the feature `zenoh`.
///
/// # Errors
///
/// Always fails with [`KeyError::NotBuilt`].
#[cfg(not(feature = "zenoh"))]
pub fn make_keys(
    _folder: &Path,
    _hosts: &[(String, Vec<String>)],
) -> Result<Vec<PathBuf>, KeyError> {
    Err(KeyError::NotBuilt)
}

/// Writes a file that only the user can read.
#[cfg(feature = "zenoh")]
fn write_private(file: &Path, text: &str) -> Result<(), KeyError> {
    use std::io::Write as _;
    use std::os::unix::fs::OpenOptionsExt as _;

    let failed = |source| KeyError::Write {
        file: file.to_owned(),
        source,
    };
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let mut options = std::fs::File::options();
    let open = options.write(true).create_new(true).mode(0o600).open(file);
    open.and_then(|mut file| file.write_all(text.as_bytes())).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_key_is_named() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("ca.pem"), "x").unwrap();
        let error = KeyFiles::find(folder.path(), "far").unwrap_err();
        assert!(
            error.to_string().ends_with("far.pem does not exist"),
            "{error}"
        );
    }

    #[cfg(feature = "zenoh")]
    #[test]
    fn keys_are_created_once_and_only_their_user_can_read_them() {
        use std::os::unix::fs::PermissionsExt as _;

        let folder = tempfile::tempdir().unwrap();
        let hosts = [
            ("desk".to_owned(), vec!["10.0.0.1".to_owned()]),
            ("far".to_owned(), Vec::new()),
        ];
        let files = make_keys(folder.path(), &hosts).unwrap();
        assert_eq!(files.len(), 6);
        for file in files {
            let mode = file.metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o077, 0, "{}", file.display());
        }
        KeyFiles::find(folder.path(), "far").unwrap();
        let again = make_keys(folder.path(), &hosts).unwrap_err();
        assert!(matches!(again, KeyError::Exists(_)));
    }
}
