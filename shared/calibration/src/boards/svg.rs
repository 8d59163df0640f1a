//! Output of a drawing as SVG.

use core::fmt::Write as _;

use crate::boards::{Drawing, Shape};

/// Returns an SVG file, in millimetres.
pub fn svg(drawing: &Drawing) -> String {
    let [width, height] = drawing.page;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    );
    for shape in &drawing.shapes {
        let line = match shape {
            Shape::Rectangle { at, size, is_black } => format!(
                "<rect x=\"{:.4}\" y=\"{:.4}\" width=\"{:.4}\" height=\"{:.4}\" fill=\"{}\"/>",
                at[0],
                at[1],
                size[0],
                size[1],
                if *is_black { "#000" } else { "#fff" }
            ),
            Shape::Text { at, size, text } => format!(
                "<text x=\"{:.4}\" y=\"{:.4}\" font-size=\"{size}\" font-family=\"sans-serif\">{}</text>",
                at[0],
                at[1],
                text.replace('&', "&amp;").replace('<', "&lt;")
            ),
        };
        // Writing to a string cannot fail.
        writeln!(out, "{line}").unwrap_or_default();
    }
    out + "</svg>\n"
}
