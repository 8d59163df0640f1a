//! Finds views in which people are too small or too large for the search, and suggests a setting.

use geometry::search_size::{USABLE_PX, better_scale};
use runfiles::RunSummary;
use serde::Serialize;

/// Views in which people are too small or too large for the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Outside {
    /// Name of each view, and median height of people in pixels of its frames.
    pub views: Vec<(String, f64)>,
    /// Value of `capture.scale` that suits all views.
    pub scale: f64,
    /// True if the deployment sets `capture.size`, which takes precedence over `capture.scale`.
    pub has_size: bool,
}

impl Outside {
    /// Finds the views in which people are too small or too large. Returns `None` if all people have a suitable size, or there are no
    /// people.
    ///
    /// * `has_size`: true if the deployment sets `capture.size`.
    pub(super) fn of(run: &RunSummary, has_size: bool) -> Option<Self> {
        let views = run.views.iter().filter_map(|view| {
            let px = run.summary.person_px.get(&view.name).copied().flatten()?;
            let [[a, b, _], [c, d, _]] = view.source_from_frame;
            Some((view.name.clone(), 1.0 / (a * d - b * c).abs().sqrt(), px))
        });
        let views: Vec<(String, f64, f64)> = views.collect();
        let seen: Vec<[f64; 2]> = views.iter().map(|view| [view.1, view.2]).collect();
        let is_outside = |px: f64| !(USABLE_PX[0]..=USABLE_PX[1]).contains(&px);
        let outside = views.into_iter().filter(|view| is_outside(view.2));
        let views: Vec<(String, f64)> = outside.map(|outside| (outside.0, outside.2)).collect();
        let scale = better_scale(&seen).filter(|_| !views.is_empty())?;
        Some(Self {
            views,
            scale,
            has_size,
        })
    }

    /// Returns the text for the user.
    pub(super) fn text(&self) -> String {
        let views = self.views.iter();
        let views: Vec<String> =
            views.map(|(name, px)| format!("{px:.0} px high in {name}")).collect();
        format!(
            "people are {} ({} to {} px are best for the search): set capture.scale = {}{}",
            views.join(", "),
            USABLE_PX[0],
            USABLE_PX[1],
            self.scale,
            if self.has_size {
                " in place of capture.size"
            } else {
                ""
            }
        )
    }
}

#[cfg(test)]
mod tests {
    use runfiles::{LatencyReport, Summary, VERSION, ViewSummary};

    use super::*;

    fn outside(scale: f64, px: [Option<f64>; 2]) -> Option<String> {
        let views = ["c1", "c2"].map(|name| ViewSummary {
            frame_size: [272, 480],
            name: name.to_owned(),
            source_from_frame: [[0.0, -1.0 / scale, 9.0], [1.0 / scale, 0.0, 9.0]],
        });
        let run = RunSummary {
            frame_rate_hz: None,
            joints: "parse14".to_owned(),
            latency: LatencyReport::default(),
            schema_version: VERSION,
            session: 1,
            summary: Summary {
                person_px: views.iter().map(|view| view.name.clone()).zip(px).collect(),
                ..Summary::default()
            },
            trc_axes: "y up".to_owned(),
            views: views.into(),
        };
        Outside::of(&run, scale < 1.0).map(|outside| outside.text())
    }

    #[test]
    fn people_who_are_too_large_or_too_small_give_a_warning_with_a_better_scale() {
        let said = outside(1.0, [Some(620.0), Some(300.0)]).unwrap();
        assert_eq!(
            said,
            "people are 620 px high in c1 (110 to 350 px are best for the search): set capture.scale = 0.46"
        );
        let said = outside(0.25, [Some(50.0), Some(50.0)]).unwrap();
        assert!(
            said.contains("50 px high in c1, 50 px high in c2"),
            "{said}"
        );
        assert!(
            said.ends_with("set capture.scale = 1 in place of capture.size"),
            "{said}"
        );
    }

    #[test]
    fn people_of_a_good_height_and_empty_rooms_give_no_warning() {
        assert_eq!(outside(1.0, [Some(110.0), Some(350.0)]), None);
        assert_eq!(outside(1.0, [None, None]), None);
    }
}
