//! The paper's tables as LaTeX.

use statistics::score::{Bootstrap, SEGMENT_NAMES};

use crate::evaluation::{Group, Pictures, Summary, Version, published};

/// Returns tables of PCP3D: a row for each group, then a row for each version with all parts. The paper's numbers are in
/// parentheses, where they exist.
///
/// * `versions`: the versions of the summary.
pub fn latex(summary: &Summary, versions: &[Version]) -> String {
    let mut out = String::new();
    let titles: Vec<String> = versions.iter().map(|version| version.title()).collect();
    let words = |strings: &[String]| strings.to_vec();
    let caption = "PCP3D (\\%) at 0.5; in parentheses as published";
    begin(&mut out, caption, 3 + versions.len());
    let names = ["Data set", "Subject", "Sequence"].map(str::to_owned);
    line(&mut out, &[words(&names), words(&titles)].concat());
    out.push_str("\\hline\n");
    for group in &summary.groups {
        let names = [&group.dataset, &group.subject, &group.action].map(|name| escape(name));
        line(&mut out, &[words(&names), cells(group, versions)].concat());
    }
    end(&mut out);
    let caption = "PCP3D (\\%) of every part at 0.5";
    begin(&mut out, caption, 2 + SEGMENT_NAMES.len());
    let names = ["Data set", "Version"].map(str::to_owned);
    line(
        &mut out,
        &[words(&names), words(&SEGMENT_NAMES.map(str::to_owned))].concat(),
    );
    out.push_str("\\hline\n");
    for group in overall(summary) {
        for (title, it) in titles.iter().zip(&group.versions) {
            let parts: Vec<String> = it.parts.iter().map(|part| number(*part, 1)).collect();
            let names = [escape(&group.dataset), title.clone()];
            line(&mut out, &[words(&names), parts].concat());
        }
    }
    end(&mut out);
    out.replace('–', "--")
}

/// Returns the tables for single pictures.
pub fn pictures_latex(sets: &[Pictures], bootstrap: &Bootstrap) -> String {
    let mut out = String::new();
    for table in sets.iter().flat_map(|set| set.tables(bootstrap)) {
        begin(&mut out, &escape(&table.title), 1 + table.columns.len());
        let names = [vec![String::new()], table.columns.clone()].concat();
        line(&mut out, &names);
        out.push_str("\\hline\n");
        for (name, values, _) in table.rows {
            let values = values.iter().map(|value| number(Some(*value), 1));
            line(&mut out, &[vec![name], values.collect()].concat());
        }
        end(&mut out);
    }
    out
}

/// Formats a number with `digits` digits after the point; a dash for `None`.
pub fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

/// Returns the largest group of every data set.
pub fn overall(summary: &Summary) -> impl Iterator<Item = &Group> {
    let last = |(nth, it): &(usize, &Group)| {
        summary.groups[nth + 1..].iter().all(|other| other.dataset != it.dataset)
    };
    summary.groups.iter().enumerate().filter(last).map(|group| group.1)
}

/// Returns our numbers, with the paper's numbers in parentheses.
fn cells(group: &Group, versions: &[Version]) -> Vec<String> {
    let cell = |(version, it): (&Version, &crate::evaluation::Numbers)| {
        let ours = number(it.pcp3d, 2);
        match published(&group.dataset, &group.subject, &group.action, *version) {
            Some(theirs) => format!("{ours} ({theirs:.2})"),
            None => ours,
        }
    };
    versions.iter().zip(&group.versions).map(cell).collect()
}

fn begin(out: &mut String, caption: &str, n_columns: usize) {
    let columns = "c".repeat(n_columns);
    let lines = [
        "\\begin{table}".to_owned(),
        format!("\\caption{{{caption}}}"),
        format!("\\begin{{tabular}}{{{columns}}}"),
        "\\hline\n".to_owned(),
    ];
    out.push_str(&lines.join("\n"));
}

fn end(out: &mut String) {
    out.push_str("\\hline\n\\end{tabular}\n\\end{table}\n");
}

fn line(out: &mut String, cells: &[String]) {
    out.push_str(&cells.join(" & "));
    out.push_str(" \\\\\n");
}

fn escape(text: &str) -> String {
    let escape = |letter: char| match letter {
        '_' | '&' | '%' | '#' | '$' | '{' | '}' => format!("\\{letter}"),
        letter => letter.to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::testing::made_up;

    #[test]
    fn the_tables_contain_our_numbers_and_those_of_the_paper() {
        let (summary, versions) = made_up();
        let text = latex(&summary, &versions);
        assert!(
            text.contains("HumanEva & S1 & Box & 0.00 (77.34) & 100.00 (82.70) & 100.00 \\\\"),
            "{text}"
        );
        assert!(text.contains("HumanEva & All & Box & 0.00 (67.14)"));
        assert_eq!(text.matches("\\begin{table}").count(), 2);
    }
}
