//! Evaluation on single pictures of annotated people (PARSE, LSP).

use statistics::score::{
    Bootstrap, Offset, PCK_GROUPS, PCK_SHARES, Pcp, PcpRule, Report, Share, evaluate, offsets,
};

use crate::evaluation::Joints;

/// The results on the pictures of one data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Pictures {
    /// Name of the data set.
    pub name: String,
    /// Number of people who could not be used.
    pub n_left_out: usize,
    /// The true joints of every person.
    pub truths: Vec<Joints>,
    /// The detections of each person, in the order of [`Judged::ALL`]; `None` for a missing detection.
    pub found: Vec<[Option<Joints>; 2]>,
}

/// Kind of detection to evaluate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judged {
    /// The best detection in the picture, which published values of PCP use.
    Best,
    /// The best detection that covers the person, which published values of PCK use.
    OnPerson,
}

impl Judged {
    /// Both kinds, in the order of [`Pictures::found`].
    pub const ALL: [Self; 2] = [Self::Best, Self::OnPerson];

    /// Returns the title of the kind.
    pub fn title(self) -> &'static str {
        match self {
            Self::Best => "best detection of every image",
            Self::OnPerson => "best detection on the person",
        }
    }
}

/// Confidence intervals over pictures, in percent; `None` if there are no pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intervals {
    /// Intervals of PCP by the two rules: [`PcpRule::MeanOfEnds`] and [`PcpRule::BothEnds`].
    pub pcp: [Option<[f64; 2]>; 2],
    /// Interval of PCK at each of [`PCK_SHARES`].
    pub pck: [Option<[f64; 2]>; 2],
}

impl Pictures {
    /// Returns the numbers for one kind of detection.
    pub fn report(&self, which: Judged) -> Report {
        evaluate(self.pairs(which))
    }

    /// Returns the confidence intervals of these numbers, by resampling pictures.
    pub fn intervals(&self, which: Judged, bootstrap: &Bootstrap) -> Intervals {
        let each: Vec<Report> = self.pairs(which).map(|pair| evaluate([pair])).collect();
        let over = |count: &dyn Fn(&Report) -> Pcp| {
            let share = |report: &Report| {
                let count = count(report);
                Share {
                    sum: 100.0 * count.correct as f64,
                    n: count.total as f64,
                }
            };
            bootstrap.interval(&each.iter().map(share).collect::<Vec<_>>())
        };
        Intervals {
            pcp: RULES.map(|(rule, _)| over(&|image| image.pcp(rule))),
            pck: [0, 1].map(|share| over(&|image| image.pck(share))),
        }
    }

    /// Returns the mean offset of every joint of the best detection on the person, along and across its bone.
    pub fn offsets(&self, bootstrap: &Bootstrap) -> Vec<Offset> {
        offsets(self.pairs(Judged::OnPerson), bootstrap)
    }

    /// Returns the tables of the data set, with PCP and PCK of both kinds of detection, in percent.
    pub fn tables(&self, bootstrap: &Bootstrap) -> Vec<Table> {
        tables(self, bootstrap)
    }

    fn pairs(&self, which: Judged) -> impl Iterator<Item = (Option<&Joints>, &Joints)> {
        let place = which as usize;
        let found = self.found.iter().map(move |found| found[place].as_ref());
        found.zip(&self.truths)
    }
}

/// Rules of PCP, and their names.
const RULES: [(PcpRule, &str); 2] = [
    (PcpRule::MeanOfEnds, "mean of ends"),
    (PcpRule::BothEnds, "both ends"),
];

/// A table of percentages.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Title of the table.
    pub title: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Rows: name, a number for every column, and the confidence interval of the last number.
    pub rows: Vec<(String, Vec<f64>, Option<[f64; 2]>)>,
}

fn tables(set: &Pictures, bootstrap: &Bootstrap) -> Vec<Table> {
    let mut tables = Vec::new();
    for which in Judged::ALL {
        let report = set.report(which);
        let intervals = set.intervals(which, bootstrap);
        let title = |what: &str| {
            let (n, missed) = (report.n_images(), report.n_missed());
            let judged = which.title();
            format!(
                "{}: {what}, {judged}; {n} images, no detection in {missed}",
                set.name
            )
        };
        let limbs = report.limbs(PcpRule::MeanOfEnds).map(|limb| limb.0);
        let by_rule = RULES.iter().zip(intervals.pcp).map(|((rule, name), interval)| {
            let mut row: Vec<f64> =
                report.limbs(*rule).iter().map(|limb| limb.1.percent()).collect();
            row.push(report.pcp(*rule).percent());
            ((*name).to_owned(), row, interval)
        });
        tables.push(Table {
            title: title("PCP, %"),
            columns: columns(limbs.into_iter(), "total"),
            rows: by_rule.collect(),
        });
        let by_share = PCK_SHARES.iter().enumerate().map(|(share, of_size)| {
            let mut row: Vec<f64> = report.groups(share).iter().map(Pcp::percent).collect();
            row.push(report.pck(share).percent());
            (
                format!("within {of_size} of size"),
                row,
                intervals.pck[share],
            )
        });
        tables.push(Table {
            title: title("PCK, %"),
            columns: columns(PCK_GROUPS.iter().map(|pck_group| pck_group.0), "mean"),
            rows: by_share.collect(),
        });
    }
    tables
}

fn columns<'a>(names: impl Iterator<Item = &'a str>, last: &'a str) -> Vec<String> {
    names.chain([last]).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::pictures_latex;

    fn person(x: f64) -> Joints {
        core::array::from_fn(|i| [x + 10.0 * (i % 4) as f64, 25.0 * (i / 4) as f64])
    }

    /// Three pictures. The person is detected in two of them, but in one of these two, the best detection of the picture is not on the
    /// person.
    fn pictures() -> Pictures {
        let (here, there) = (Some(person(0.0)), Some(person(500.0)));
        Pictures {
            name: "parse & co".to_owned(),
            n_left_out: 1,
            truths: vec![person(0.0); 3],
            found: vec![[here, here], [there, here], [None, None]],
        }
    }

    #[test]
    fn both_kinds_of_detections_are_counted_separately() {
        let total = |which| pictures().report(which).pck(0).percent().round();
        assert_eq!(total(Judged::Best), 33.0);
        assert_eq!(total(Judged::OnPerson), 67.0);
    }

    #[test]
    fn intervals_contain_the_value_and_have_no_width_for_equal_pictures() {
        let bootstrap = Bootstrap::default();
        let it = pictures().intervals(Judged::OnPerson, &bootstrap);
        let [low, high] = it.pcp[0].unwrap();
        assert!(low < 66.0 && 67.0 < high, "{low} {high}");
        let one = Pictures {
            truths: vec![person(0.0); 9],
            found: vec![[Some(person(0.0)); 2]; 9],
            ..pictures()
        };
        let it = one.intervals(Judged::Best, &bootstrap);
        assert_eq!((it.pcp[1], it.pck[1]), (Some([100.0; 2]), Some([100.0; 2])));
        let none = Pictures {
            truths: Vec::new(),
            found: Vec::new(),
            ..pictures()
        };
        assert_eq!(none.intervals(Judged::Best, &bootstrap).pcp, [None; 2]);
    }

    #[test]
    fn the_latex_tables_contain_every_number_and_escape_names() {
        let tex = pictures_latex(&[pictures()], &Bootstrap::default());
        assert_eq!(tex.matches("\\begin{table}").count(), 4);
        assert!(
            tex.contains("parse \\& co") && tex.contains("66.7"),
            "{tex}"
        );
    }
}
