//! The parameter section: groups of named values.

use crate::c3d::C3dError;
use crate::c3d::numbers::{BLOCK, Bytes};

/// A parameter, whose value is still encoded.
#[derive(Debug, Clone)]
struct Parameter<'a> {
    /// Number of the parameter's group.
    id: u8,
    name: String,
    /// Kind of value: -1 for characters; 1, 2 or 4 for numbers of that many bytes.
    kind: i8,
    /// Sizes of the value; the first index varies fastest.
    sizes: &'a [u8],
    data: &'a [u8],
}

/// All parameters of a file.
#[derive(Debug)]
pub(crate) struct Parameters<'a> {
    bytes: Bytes<'a>,
    /// Number and name of each group.
    groups: Vec<(u8, String)>,
    entries: Vec<Parameter<'a>>,
}

/// Number of bytes in the header of the section.
const HEAD: usize = 4;

impl<'a> Parameters<'a> {
    /// Reads the section that begins at byte `section`.
    ///
    /// A link that points outside the section is ignored, because the length of an entry also follows from its content. Sample files of
    /// c3d.org have a link whose bytes are swapped.
    pub(crate) fn read(bytes: Bytes<'a>, section: usize) -> Result<Self, C3dError> {
        const WHAT: &str = "a parameter";
        let mut parameters = Self {
            bytes,
            groups: Vec::new(),
            entries: Vec::new(),
        };
        let n_blocks = usize::from(bytes.u8(section + 2, WHAT)?);
        let end = section + n_blocks * BLOCK;
        let mut at = section + HEAD;
        // A file whose last parameter extends to the last byte has no end mark.
        while let (Ok(length), Ok(id)) = (bytes.u8(at, WHAT), bytes.u8(at + 1, WHAT)) {
            let (length, id) = (length as i8, id as i8);
            if length == 0 || id == 0 {
                break;
            }
            let n = usize::from(length.unsigned_abs());
            let name = text(bytes.slice(at + 2, n, WHAT)?).to_ascii_uppercase();
            let link = at + 2 + n;
            let offset = usize::from(bytes.u16(link, WHAT)?);
            let own_end = if id < 0 {
                parameters.groups.push((id.unsigned_abs(), name));
                link + 2
            } else {
                parameters.parameter(at, link + 2, id.unsigned_abs(), name)?
            };
            if offset == 0 {
                break;
            }
            if offset < 2 {
                let what = "a parameter points back into itself";
                return Err(C3dError::Parameter { at, what });
            }
            at = link + offset;
            if n_blocks > 0 && at >= end {
                // The value is followed by the length of the description and the description itself.
                at = own_end + 1 + usize::from(bytes.u8(own_end, WHAT)?);
            }
        }
        Ok(parameters)
    }

    /// Reads the value of a parameter; returns the position at which it ends.
    fn parameter(
        &mut self,
        at: usize,
        body: usize,
        id: u8,
        name: String,
    ) -> Result<usize, C3dError> {
        const WHAT: &str = "the value of a parameter";
        let kind = self.bytes.u8(body, WHAT)? as i8;
        if ![-1, 1, 2, 4].contains(&kind) {
            let what = "a parameter of a kind other than -1, 1, 2 and 4";
            return Err(C3dError::Parameter { at, what });
        }
        let n_sizes = usize::from(self.bytes.u8(body + 1, WHAT)?);
        let sizes = self.bytes.slice(body + 2, n_sizes, WHAT)?;
        let width = usize::from(kind.unsigned_abs());
        let product = sizes.iter().try_fold(width, |n, &it| n.checked_mul(usize::from(it)));
        let what = "a parameter with more values than can be counted";
        let n = product.ok_or(C3dError::Parameter { at, what })?;
        let first = body + 2 + n_sizes;
        let data = self.bytes.slice(first, n, WHAT)?;
        self.entries.push(Parameter {
            id,
            name,
            kind,
            sizes,
            data,
        });
        Ok(first + n)
    }

    fn get(&self, group: &str, name: &str) -> Option<&Parameter<'a>> {
        let id = self.groups.iter().find(|entry| entry.1 == group)?.0;
        let mut all = self.entries.iter();
        all.find(|parameter| parameter.id == id && parameter.name == name)
    }

    /// Returns a text, without surrounding blanks.
    pub(crate) fn text(&self, group: &str, name: &str) -> Option<String> {
        let parameter = self.get(group, name)?;
        (parameter.kind == -1).then(|| text(parameter.data))
    }

    /// Returns the first `most` texts of a list; empty if there is no such parameter.
    pub(crate) fn texts(&self, group: &str, name: &str, most: usize) -> Vec<String> {
        let Some(parameter) = self.get(group, name).filter(|parameter| parameter.kind == -1) else {
            return Vec::new();
        };
        match parameter.sizes {
            &[width, ..] if width > 0 => {
                let each = parameter.data.chunks(usize::from(width));
                each.take(most).map(text).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Returns the first number of a parameter of any kind; whole numbers are unsigned.
    pub(crate) fn number(&self, group: &str, name: &str) -> Option<f64> {
        let parameter = self.get(group, name)?;
        match (parameter.kind, parameter.data) {
            (1, &[a, ..]) => Some(f64::from(a)),
            (2, &[a, b, ..]) => Some(f64::from(self.bytes.u16_of([a, b]))),
            (4, &[a, b, c, d, ..]) => Some(f64::from(self.bytes.f32_of([a, b, c, d]))),
            _ => None,
        }
    }

    /// Returns a 32-bit whole number stored as two words, the lower first; `None` for a parameter of any other form.
    pub(crate) fn double_word(&self, group: &str, name: &str) -> Option<f64> {
        let parameter = self.get(group, name).filter(|parameter| parameter.kind == 2)?;
        let &[a, b, c, d] = parameter.data else {
            return None;
        };
        let [low, high] = [[a, b], [c, d]].map(|pair| f64::from(self.bytes.u16_of(pair)));
        Some(high * 65536.0 + low)
    }
}

/// Decodes Latin-1 text, without surrounding blanks.
fn text(bytes: &[u8]) -> String {
    let all: String = bytes.iter().map(|&byte| char::from(byte)).collect();
    all.trim_matches(|letter: char| letter == '\0' || letter.is_whitespace())
        .to_owned()
}
