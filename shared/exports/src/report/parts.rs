//! Parts that several pages share: their beginning, the verdict, the description of the input, numbers.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::report::html::{Html, STYLE, html, put};

/// Returns the beginning of a page, up to its heading.
pub fn begin(title: &str) -> Html {
    let mut out = html!("<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n");
    put!(
        out,
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<style>\n{}</style>\n<h1>{}</h1>\n",
        title,
        Html::constant(STYLE),
        title
    );
    out
}

/// Writes the verdict (usable or not), with the doubts.
///
/// * `good`, `bad`: texts without and with doubts.
pub fn verdict(out: &mut Html, (good, bad): (&str, &str), doubts: &[String]) {
    if doubts.is_empty() {
        put!(out, "<p class=\"verdict held\">{}</p>\n", good);
        return;
    }
    put!(out, "<p class=\"verdict missed\">{}</p>\n<ul>\n", bad);
    for it in doubts {
        put!(out, "<li>{}</li>\n", it);
    }
    put!(out, "</ul>\n");
}

/// Writes the description of the input or of the run: key and value.
pub fn about_table(out: &mut Html, about: &[(String, String)]) {
    put!(out, "<div class=\"scroll\"><table>\n");
    for (key, value) in about {
        put!(
            out,
            "<tr><td>{}</td><td class=\"name\">{}</td></tr>\n",
            key,
            value
        );
    }
    put!(out, "</table></div>\n");
}

/// Writes the pictures that fit worst, each as JPEG with a caption.
///
/// * `drawn`: description of the drawings in the pictures.
pub fn worst(out: &mut Html, drawn: &'static str, pictures: &[(String, Vec<u8>)]) {
    if pictures.is_empty() {
        return;
    }
    put!(
        out,
        "<h2>The pictures that fit worst</h2>\n<p><small>{}</small></p>\n<div class=\"strip\">\n",
        Html::constant(drawn)
    );
    for (caption, jpeg) in pictures {
        let data = STANDARD.encode(jpeg);
        put!(
            out,
            "<figure><img alt=\"{caption}\" src=\"data:image/jpeg;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n",
            [caption, data]
        );
    }
    put!(out, "</div>\n");
}

/// Formats a number with some decimals; a dash if it is not finite.
pub fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() {
        format!("{value:.decimals$}")
    } else {
        "-".to_owned()
    }
}
