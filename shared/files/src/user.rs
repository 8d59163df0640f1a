//! Names of users, for messages.

use std::fs;

/// Returns the name and number of a user, such as `user nobody (65534)`, or the number alone if the system has no name for it.
pub fn user(uid: u32) -> String {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    let name = users.lines().find_map(|line| {
        let mut cells = line.split(':');
        let name = cells.next()?;
        (cells.nth(1)?.parse() == Ok(uid)).then_some(name)
    });
    name.map_or_else(
        || format!("user {uid}"),
        |name| format!("user {name} ({uid})"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_users_have_names() {
        assert_eq!(user(0), "user root (0)");
        assert_eq!(user(4_000_000_000), "user 4000000000");
    }
}
