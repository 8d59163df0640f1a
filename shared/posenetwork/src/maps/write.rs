//! How maps are written over one another.

/// How values are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Write {
    /// In the place of others.
    Over,
    /// Where they are higher than others.
    Highest,
}
