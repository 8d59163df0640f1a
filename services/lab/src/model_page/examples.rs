//! Types by example: pictures of what the model took for each type of a part.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use report::html::Html;
use report::{html, put};

/// Side of an example on the page, pixels.
const SIDE: usize = 42;

/// Pictures of every type of every part.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Examples {
    /// PNG files, `[part][type]`, the most certain first; parts and types without any may be missing at
    /// the end.
    pub png: Vec<Vec<Vec<Vec<u8>>>>,
}

/// The examples of a type, in rows.
pub(super) fn of_type(examples: &Examples, part: usize, mixture: usize) -> Html {
    let found = examples.png.get(part).and_then(|it| it.get(mixture));
    let mut out = html!("<div class=\"examples\">");
    for png in found.into_iter().flatten() {
        let data = STANDARD.encode(png);
        put!(
            out,
            "<img alt=\"\" width=\"{SIDE}\" height=\"{SIDE}\" src=\"data:image/png;base64,{data}\"/>",
            [SIDE, data]
        );
    }
    put!(out, "</div>\n");
    out
}
