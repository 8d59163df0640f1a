//! The report of single pictures.

use evaluation::Bootstrap;

use super::page::{about_table, head, put};
use super::table::{begin, end, escape as escape_latex, line};
use super::{escape, number};
use crate::Pictures;
use crate::pictures::tables;

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
    for table in sets.iter().flat_map(|it| tables(it, bootstrap)) {
        put(
            &mut out,
            format_args!(
                "<h2>{}</h2>\n<div class=\"scroll\"><table>\n<tr><th>",
                escape(&table.title)
            ),
        );
        for column in &table.columns {
            put(&mut out, format_args!("<th>{}", escape(column)));
        }
        let confidence = 100.0 * bootstrap.confidence;
        put(
            &mut out,
            format_args!("<th>{confidence:.0} % interval over pictures</tr>\n"),
        );
        for (name, values, interval) in &table.rows {
            put(&mut out, format_args!("<tr><td>{}", escape(name)));
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

/// The same tables for LaTeX.
pub fn pictures_latex(sets: &[Pictures], bootstrap: &Bootstrap) -> String {
    let mut out = String::new();
    for table in sets.iter().flat_map(|it| tables(it, bootstrap)) {
        begin(
            &mut out,
            &escape_latex(&table.title),
            1 + table.columns.len(),
        );
        let names = [vec![String::new()], table.columns.clone()].concat();
        line(&mut out, &names);
        out.push_str("\\hline\n");
        for (name, values, _) in table.rows {
            let values = values.iter().map(|it| number(Some(*it), 1));
            line(&mut out, &[vec![name], values.collect()].concat());
        }
        end(&mut out);
    }
    out
}
