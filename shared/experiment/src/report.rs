//! The report: one page of HTML that needs nothing else, and tables for LaTeX.

mod figure;
mod page;
mod pictures;
mod table;

pub use page::{Page, html};
pub use pictures::{pictures_html, pictures_latex};
pub use table::latex;

/// A number with so many digits after the point, or a dash.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |it| format!("{it:.digits$}"))
}

/// Text that means itself in HTML.
fn escape(text: &str) -> String {
    let escape = |it: char| match it {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        it => it.to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests;
