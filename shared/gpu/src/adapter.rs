//! Graphics cards, and programs that play one.

use core::fmt;

/// A graphics card, or a program that plays one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// Its name, as its driver says it.
    pub name: String,
    /// The kind of device.
    pub kind: Kind,
    /// Name and version of its driver.
    pub driver: String,
}

/// The kind of an adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A program that computes on the processor: slower than the steps that are made for it.
    Software,
    /// None of the others.
    Other,
    /// A share of a card, in a virtual machine.
    Virtual,
    /// Part of the processor.
    Integrated,
    /// A card.
    Discrete,
}

/// Which adapters may be opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The best one that is not software.
    Hardware,
    /// The best one, software too: for tests.
    Any,
}

impl fmt::Display for Adapter {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} ({}, {})", self.name, self.kind, self.driver)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(match self {
            Self::Software => "software",
            Self::Other => "other",
            Self::Virtual => "virtual",
            Self::Integrated => "integrated",
            Self::Discrete => "discrete",
        })
    }
}
