//! Iterates over the whitespace-separated tokens of a text, with their positions.

use std::str::FromStr;

use super::error::{TextError, TextPosition};

/// The tokens of a text.
#[derive(Debug, Clone)]
pub(super) struct Tokens<'a> {
    rest: &'a str,
    place: TextPosition,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let mut tokens = Self {
            rest: text,
            place: TextPosition { line: 1, token: 0 },
        };
        tokens.advance(0);
        tokens
    }

    /// Returns the position of the next token.
    pub(super) fn place(&self) -> TextPosition {
        self.place
    }

    /// Returns the next token, without consuming it.
    pub(super) fn peek(&self) -> Option<&'a str> {
        self.rest.split_whitespace().next()
    }

    /// Consumes the next token if it is this keyword.
    pub(super) fn skip(&mut self, word: &str) -> bool {
        let found = self.peek() == Some(word);
        if found {
            self.advance(word.len());
        }
        found
    }

    /// Consumes a required keyword.
    pub(super) fn keyword(&mut self, field: &'static str) -> Result<(), TextError> {
        let place = self.place();
        match self.peek() {
            _ if self.skip(field) => Ok(()),
            None => Err(TextError::Ended { field, place }),
            Some(got) => Err(TextError::Keyword {
                field,
                place,
                got: shortened(got),
            }),
        }
    }

    /// Returns the next token as a number; `kind` describes the expected numbers.
    pub(super) fn number<T: FromStr>(
        &mut self,
        field: &'static str,
        kind: &'static str,
    ) -> Result<T, TextError> {
        let Some(got) = self.peek() else {
            return Err(TextError::Ended {
                field,
                place: self.place(),
            });
        };
        let Ok(value) = got.parse() else {
            return Err(TextError::Number {
                field,
                place: self.place(),
                kind,
                got: shortened(got),
            });
        };
        self.advance(got.len());
        Ok(value)
    }

    /// Returns an upper bound of the number of remaining tokens, which limits the memory reserved for a count in the file.
    pub(super) fn at_most(&self) -> usize {
        self.rest.len().div_ceil(2)
    }

    /// Consumes the next token, which has `bytes` bytes, and the following white space.
    fn advance(&mut self, bytes: usize) {
        let behind = &self.rest[bytes..];
        self.rest = behind.trim_start();
        let space = &behind[..behind.len() - self.rest.len()];
        self.place.line += space.bytes().filter(|&byte| byte == b'\n').count();
        self.place.token += 1;
    }
}

/// At most 24 characters of a token, for an error message.
pub(super) fn shortened(token: &str) -> String {
    token.chars().take(24).collect()
}
