//! HTML page for single pictures.

use crate::evaluation::{Pictures, number};
use statistics::score::Bootstrap;

use exports::report::parts::{about_table, begin};
use exports::report::put;

/// Returns one self-contained page.
///
/// * `about`: description of the run, as keys and values.
pub fn pictures_html(
    sets: &[Pictures],
    about: &[(String, String)],
    bootstrap: &Bootstrap,
) -> String {
    let mut out = begin("Parallax: evaluation");
    about_table(&mut out, about);
    for table in sets.iter().flat_map(|set| set.tables(bootstrap)) {
        put!(
            out,
            "<h2>{}</h2>\n<div class=\"scroll\"><table>\n<tr><th>",
            table.title
        );
        for column in &table.columns {
            put!(out, "<th>{}", column);
        }
        let confidence = 100.0 * bootstrap.confidence;
        put!(
            out,
            "<th>{confidence:.0} % interval over pictures</tr>\n",
            [confidence]
        );
        for (name, values, interval) in &table.rows {
            put!(out, "<tr><td>{}", name);
            for value in values {
                put!(out, "<td>{value:.1}", [value]);
            }
            let ends = interval.map_or([None; 2], |interval| interval.map(Some));
            let [low, high] = ends.map(|end| number(end, 1));
            put!(out, "<td>{low} to {high}</tr>\n", [low, high]);
        }
        put!(out, "</table></div>\n");
    }
    put!(out, "</html>\n");
    out.into_page()
}
