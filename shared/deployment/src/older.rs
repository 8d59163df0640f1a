//! Names of sections that deployment files once had, and that are still read.

use toml::Table;

/// Older names of sections, with the names of today.
pub(crate) const OLDER: [(&str, &str); 1] = [("record", "results")];

/// A section that is given by both names.
pub(super) struct Both {
    /// The older name.
    pub(super) older: &'static str,
    /// What to do.
    pub(super) message: String,
}

/// A key by the name that its section has today.
pub(super) fn of_today(key: &str) -> String {
    let (section, rest) = key.split_once('.').unwrap_or((key, ""));
    match OLDER.iter().find(|it| it.0 == section) {
        Some((_, name)) => format!("{name}.{rest}"),
        None => key.to_owned(),
    }
}

/// Gives sections the names that they have today.
pub(super) fn rename_older(table: &mut Table) -> Result<(), Both> {
    for (older, name) in OLDER {
        let Some(section) = table.remove(older) else {
            continue;
        };
        if table.contains_key(name) {
            let message = format!(
                "`{older}` is the older name of `{name}`, and both are given: move the keys of `{older}` to `{name}`"
            );
            return Err(Both { older, message });
        }
        table.insert(name.to_owned(), section);
    }
    Ok(())
}
