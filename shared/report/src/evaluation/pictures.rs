//! The page of single pictures.

use evaluation::Bootstrap;
use experiment::{Pictures, number};

use super::{about_table, head};
use crate::html::{escaped, put};

/// One page that needs no other file.
///
/// * `about`: what was run: key and value.
pub fn pictures_html(
    sets: &[Pictures],
    about: &[(String, String)],
    bootstrap: &Bootstrap,
) -> String {
    let mut out = head();
    about_table(&mut out, about);
    for table in sets.iter().flat_map(|it| it.tables(bootstrap)) {
        put(
            &mut out,
            format_args!(
                "<h2>{}</h2>\n<div class=\"scroll\"><table>\n<tr><th>",
                escaped(&table.title)
            ),
        );
        for column in &table.columns {
            put(&mut out, format_args!("<th>{}", escaped(column)));
        }
        let confidence = 100.0 * bootstrap.confidence;
        put(
            &mut out,
            format_args!("<th>{confidence:.0} % interval over pictures</tr>\n"),
        );
        for (name, values, interval) in &table.rows {
            put(&mut out, format_args!("<tr><td>{}", escaped(name)));
            for value in values {
                put(&mut out, format_args!("<td>{value:.1}"));
            }
            let ends = interval.map_or([None; 2], |it| it.map(Some));
            let [low, high] = ends.map(|it| number(it, 1));
            put(&mut out, format_args!("<td>{low} to {high}</tr>\n"));
        }
        out.push_str("</table></div>\n");
    }
    out.push_str("</html>\n");
    out
}
