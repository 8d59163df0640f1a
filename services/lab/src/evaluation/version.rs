//! Versions of the method to compare.

use std::fmt;
use std::str::FromStr;

/// Terms between views; each variant includes the terms of the previous variants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Terms {
    /// No terms: flexible mixtures of parts in every view, then triangulation.
    Single,
    /// Distances to epipolar lines.
    Geometry,
    /// Part types.
    Appearance,
    /// Adaptive selection: in addition, parts with a large expected error are switched off.
    Adaptive,
}

/// Method that combines more than two views.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Combining {
    /// Pairs of views, and the mean of their results, as in the paper.
    Pairs,
    /// Pairs of views, and a consensus of all views.
    Consensus,
    /// All views at once, with the sum of the terms of all pairs.
    AllViews,
    /// All views at once, with the mean of the terms of the other views for each view.
    AllViewsMean,
}

/// One version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// The terms between views.
    pub terms: Terms,
    /// The method that combines views.
    pub combining: Combining,
}

/// Error: the text does not name a version.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{text:?} is not a version: expected fmp, geometry, appearance or adaptive; the last three may end in +consensus, +all-views or \
     +all-views-mean"
)]
pub struct VersionError {
    /// The text.
    pub text: String,
}

const TERMS: [(Terms, &str, &str); 4] = [
    (Terms::Single, "fmp", "FMP"),
    (Terms::Geometry, "geometry", "Geom."),
    (Terms::Appearance, "appearance", "+App."),
    (Terms::Adaptive, "adaptive", "+Adap."),
];

const COMBINING: [(Combining, &str, &str); 4] = [
    (Combining::Pairs, "", ""),
    (Combining::Consensus, "+consensus", ", consensus"),
    (Combining::AllViews, "+all-views", ", all views"),
    (
        Combining::AllViewsMean,
        "+all-views-mean",
        ", all views (mean)",
    ),
];

impl Version {
    /// The baseline, in which every view is solved alone.
    pub const SINGLE: Self = Self {
        terms: Terms::Single,
        combining: Combining::Pairs,
    };

    /// Returns the title of the version in the paper's tables.
    pub fn title(self) -> String {
        let terms = TERMS.iter().find(|term| term.0 == self.terms);
        let combining = COMBINING.iter().find(|known| known.0 == self.combining);
        let words = [
            terms.map_or("", |term| term.2),
            combining.map_or("", |combining| combining.2),
        ];
        words.concat()
    }
}

impl fmt::Display for Version {
    /// Writes the name of the version in settings, for example `geometry+all-views`.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let terms = TERMS.iter().find(|term| term.0 == self.terms);
        let combining = COMBINING.iter().find(|known| known.0 == self.combining);
        out.write_str(terms.map_or("", |term| term.1))?;
        out.write_str(combining.map_or("", |combining| combining.1))
    }
}

impl FromStr for Version {
    type Err = VersionError;

    fn from_str(text: &str) -> Result<Self, VersionError> {
        for (terms, name, _) in TERMS {
            for (combining, suffix, _) in COMBINING {
                let is_known = terms != Terms::Single || combining == Combining::Pairs;
                if is_known && text.strip_prefix(name) == Some(suffix) {
                    return Ok(Self { terms, combining });
                }
            }
        }
        let text = text.to_owned();
        Err(VersionError { text })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parsed_back() {
        for (terms, ..) in TERMS {
            for (combining, ..) in COMBINING {
                let version = Version { terms, combining };
                let got = version.to_string().parse();
                if terms == Terms::Single && combining != Combining::Pairs {
                    assert!(got.is_err(), "{version}");
                } else {
                    assert_eq!(got, Ok(version));
                }
            }
        }
    }

    #[test]
    fn other_names_are_refused() {
        for text in ["", "fmp+consensus", "geometry+", "all-views", "Geometry"] {
            assert!(text.parse::<Version>().is_err(), "{text}");
        }
    }
}
