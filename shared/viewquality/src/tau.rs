//! Thresholds of the expected error above which a part is switched off.

/// Measurements by the authors of the paper on a training set, in pixels of the set's images, one value per part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainingErrors {
    /// Median error of the single-view pose.
    pub median_px: [f32; 26],
    /// Mean absolute error of the network that predicts that error.
    pub inaccuracy_px: [f32; 26],
}

impl TrainingErrors {
    /// Measurements on HumanEva-I (640x480), from the constants of the authors' program.
    pub const HUMANEVA: Self = Self {
        median_px: [
            9.783, 8.302, 8.008, 22.404, 13.370, 13.751, 15.090, 9.573, 10.866, 10.209, 21.458,
            13.080, 13.470, 17.969, 10.036, 24.467, 12.833, 12.534, 14.397, 8.887, 9.986, 9.394,
            22.635, 11.236, 11.731, 13.609,
        ],
        inaccuracy_px: [
            8.294, 3.333, 6.033, 7.081, 11.048, 12.068, 15.906, 5.437, 4.747, 4.564, 6.264, 8.635,
            9.793, 12.687, 6.576, 7.065, 10.995, 12.031, 16.691, 5.654, 4.677, 4.391, 6.052, 8.105,
            9.462, 12.061,
        ],
    };

    /// Measurements on UMPM (644x486), from the constants of the authors' program.
    ///
    /// The inaccuracy of part 16, 23.258, is due to a mistake in their data: that part was trained
    /// with the errors of part 6. The published value is kept, so that their runs can be reproduced.
    pub const UMPM: Self = Self {
        median_px: [
            4.713, 4.372, 6.777, 7.732, 9.641, 12.699, 16.146, 6.152, 6.082, 6.121, 5.931, 5.747,
            5.232, 4.439, 6.206, 6.423, 7.568, 9.880, 11.437, 5.738, 5.744, 5.837, 5.671, 4.562,
            4.979, 4.529,
        ],
        inaccuracy_px: [
            1.846, 2.092, 4.938, 6.230, 8.309, 10.859, 14.046, 4.294, 3.700, 3.734, 4.856, 6.798,
            7.372, 8.619, 5.500, 23.258, 9.391, 11.945, 15.378, 4.986, 4.541, 3.931, 4.975, 6.805,
            7.734, 9.352,
        ],
    };
}

/// Thresholds of the expected error in pixels, one per part: tau in the paper's eq. 7.
#[derive(Debug, Clone, PartialEq)]
pub struct Tau {
    px: Vec<f32>,
}

/// Reason why a text was rejected as a list of thresholds.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TauError {
    /// A field is not a valid number of pixels.
    #[error(
        "line {line}: `{got}` is not a threshold in pixels, expected a finite number of at least 0"
    )]
    Number {
        /// Number of the line, from 1.
        line: usize,
        /// Text of the field.
        got: String,
    },
    /// The number of thresholds differs from the number of parts.
    #[error("there are {got} thresholds, expected {expected}: one per part")]
    Count {
        /// Number of thresholds found.
        got: usize,
        /// Number of parts of the model.
        expected: usize,
    },
}

impl Tau {
    /// The thresholds of the authors' program for HumanEva: median plus inaccuracy.
    pub fn humaneva() -> Self {
        Self::median_and_inaccuracy(&TrainingErrors::HUMANEVA)
    }

    /// The thresholds of the authors' program for UMPM: median plus inaccuracy.
    pub fn umpm() -> Self {
        Self::median_and_inaccuracy(&TrainingErrors::UMPM)
    }

    /// Thresholds by the rule in the paper: the median training error alone.
    pub fn median_only(errors: &TrainingErrors) -> Self {
        Self {
            px: errors.median_px.to_vec(),
        }
    }

    /// Thresholds by the rule of the authors' program: the median training error plus the mean inaccuracy of its prediction.
    pub fn median_and_inaccuracy(errors: &TrainingErrors) -> Self {
        let both = errors.median_px.iter().zip(&errors.inaccuracy_px);
        Self {
            px: both.map(|(median, inaccuracy)| median + inaccuracy).collect(),
        }
    }

    /// Reads thresholds separated by white space or commas; `#` begins a comment.
    ///
    /// # Errors
    ///
    /// Fails with [`TauError`].
    pub fn parse(text: &str, n_parts: usize) -> Result<Self, TauError> {
        let mut px = Vec::new();
        for (line, content) in text.lines().enumerate() {
            let content = content.split('#').next().unwrap_or_default();
            let words = content.split(|letter: char| letter == ',' || letter.is_whitespace());
            for word in words.filter(|word| !word.is_empty()) {
                match word.parse() {
                    Ok(value) if (0.0..=f32::MAX).contains(&value) => px.push(value),
                    _ => {
                        return Err(TauError::Number {
                            line: line + 1,
                            got: word.chars().take(24).collect(),
                        });
                    }
                }
            }
        }
        if px.len() != n_parts {
            return Err(TauError::Count {
                got: px.len(),
                expected: n_parts,
            });
        }
        Ok(Self { px })
    }

    /// The thresholds in pixels, one per part.
    pub fn px(&self) -> &[f32] {
        &self.px
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thresholds_of_the_authors_are_median_plus_inaccuracy() {
        assert_eq!(Tau::humaneva().px()[0], 9.783 + 8.294);
        assert_eq!(Tau::umpm().px()[15], 6.423 + 23.258);
        assert_eq!(Tau::humaneva().px().len(), 26);
    }

    #[test]
    fn the_thresholds_of_the_paper_are_lower_for_every_part() {
        for (errors, program) in [
            (TrainingErrors::HUMANEVA, Tau::humaneva()),
            (TrainingErrors::UMPM, Tau::umpm()),
        ] {
            let paper = Tau::median_only(&errors);
            assert!(paper.px().iter().zip(program.px()).all(|(a, b)| a < b));
        }
    }

    #[test]
    fn reads_numbers_with_commas_lines_and_comments() {
        let tau = Tau::parse("# head, neck\n1.5, 2\n\n3 # the rest\n", 3).unwrap();
        assert_eq!(tau.px(), [1.5, 2.0, 3.0]);
    }

    #[test]
    fn rejects_invalid_thresholds() {
        for bad in ["NaN", "inf", "-1", "1e39", "x"] {
            let expected = format!(
                "line 2: `{bad}` is not a threshold in pixels, expected a finite number of at least 0"
            );
            let error = Tau::parse(&format!("1\n2 {bad}"), 3).unwrap_err().to_string();
            assert_eq!(error, expected);
        }
        let error = Tau::parse("1 2", 3).unwrap_err().to_string();
        assert_eq!(error, "there are 2 thresholds, expected 3: one per part");
    }
}
