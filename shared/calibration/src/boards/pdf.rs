//! Output of a drawing as PDF: one page, filled rectangles, and a font that every PDF reader has.

use core::fmt::Write as _;

use crate::boards::{Drawing, Shape};

/// Number of PDF points per millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// Returns a PDF file (version 1.4).
pub fn pdf(drawing: &Drawing) -> Vec<u8> {
    let [width, height] = drawing.page.map(|page| page * POINTS);
    let content = content(drawing);
    let objects = [
        // This entry asks readers not to scale the page to the paper.
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.4} {height:.4}] /Contents 4 0 R \
             /Resources << /Font << /F1 5 0 R >> >> >>"
        ),
        format!(
            "<< /Length {} >>\nstream\n{content}endstream",
            content.len()
        ),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>".to_owned(),
        "<< /Producer (Parallax) >>".to_owned(),
    ];
    let mut out = "%PDF-1.4\n".to_owned();
    let mut places = Vec::new();
    for (nth, object) in objects.iter().enumerate() {
        places.push(out.len());
        write!(out, "{} 0 obj\n{object}\nendobj\n", nth + 1).unwrap_or_default();
    }
    let table = out.len();
    let count = objects.len() + 1;
    write!(out, "xref\n0 {count}\n0000000000 65535 f \n").unwrap_or_default();
    for place in places {
        writeln!(out, "{place:010} 00000 n ").unwrap_or_default();
    }
    write!(
        out,
        "trailer\n<< /Size {count} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{table}\n%%EOF\n"
    )
    .unwrap_or_default();
    out.into_bytes()
}

/// Returns the content stream of a page, with y up from the lower left corner.
fn content(drawing: &Drawing) -> String {
    let height = drawing.page[1];
    let mut out = String::new();
    for shape in &drawing.shapes {
        let line = match shape {
            Shape::Rectangle { at, size, is_black } => format!(
                "{} g {:.4} {:.4} {:.4} {:.4} re f",
                i32::from(!is_black),
                at[0] * POINTS,
                (height - at[1] - size[1]) * POINTS,
                size[0] * POINTS,
                size[1] * POINTS
            ),
            Shape::Text { at, size, text } => format!(
                "0 g BT /F1 {:.3} Tf {:.4} {:.4} Td ({}) Tj ET",
                size * POINTS,
                at[0] * POINTS,
                (height - at[1]) * POINTS,
                text.replace('\\', "\\\\").replace('(', "\\(").replace(')', "\\)")
            ),
        };
        writeln!(out, "{line}").unwrap_or_default();
    }
    out
}
