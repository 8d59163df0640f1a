//! Graphics cards, and programs that emulate a graphics card.

use core::fmt;

/// A graphics card, or a program that emulates one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// Name of the adapter, as reported by its driver.
    pub name: String,
    /// The kind of device.
    pub kind: Kind,
    /// Name and version of the driver.
    pub driver: String,
}

/// The kind of an adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A program that emulates a graphics card on the processor. It is slower than the code written for the processor.
    Software,
    /// A device of any other kind.
    Other,
    /// A share of a card, in a virtual machine.
    Virtual,
    /// Part of the processor.
    Integrated,
    /// A graphics card.
    Discrete,
}

/// Adapters that may be opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The best adapter that is not software.
    Hardware,
    /// The best adapter, including software; for tests.
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
