//! What a view shows of one person: the maps of a network near the joints that were seen, as evidence for joints.

use multiview::JointEvidence;
use nalgebra::Vector2;
use posenetwork::{MapSettings, PersonMaps};
use skeleton::SIDES;

use crate::placed::N;
use crate::sighting::Sighting;

/// Most places of a joint that a view offers.
const N_MAXIMA: usize = 3;
/// How far beyond the box around the joints its person is looked for, share of the box's longer side.
const BEYOND: f64 = 0.3;
/// Least heat of a person's map at another person's joint that needs an explanation, 0 to 1.
const LEAST_HEAT: f64 = 0.05;
/// Standard deviation of what another person's joint explains, cells: the bump of a joint has about two.
const EXPLAINED_CELLS: f64 = 3.0;

/// The maps of a view near one person, as evidence for joints.
pub(crate) struct PersonEvidence<'a> {
    maps: PersonMaps<'a>,
    settings: MapSettings,
    /// The part of the picture where the person may be: left, top, right, bottom, pixels.
    near: [f64; 4],
    /// By joint, places in the picture that others explain, pixels.
    explained: Vec<Vec<[f64; 2]>>,
    maxima: Vec<Vec<([f64; 2], f32)>>,
    /// By how much every joint had moved from the instant of the frame when the picture was taken, pixels; empty if that was then.
    since_instant: Vec<Vector2<f64>>,
    /// Height of the window of the network about the person, pixels.
    pub(crate) window_px: f64,
}

impl<'a> PersonEvidence<'a> {
    /// The evidence of a person; `None` where no joint is seen.
    ///
    /// * `others`: the other people in the view. Of a joint of theirs that they show more clearly than these maps show it there, nothing is
    ///   left in these maps: the network saw it in the window of this person as well.
    pub(crate) fn new(
        maps: PersonMaps<'a>,
        sighting: &Sighting,
        others: &[&Sighting],
        settings: MapSettings,
    ) -> Option<Self> {
        let [left, top, right, bottom] = sighting.outline()?;
        let more = BEYOND * (right - left).max(bottom - top);
        let grid = maps.grid();
        let mut evidence = Self {
            maps,
            settings,
            near: [left - more, top - more, right + more, bottom + more],
            explained: vec![Vec::new(); N],
            maxima: Vec::new(),
            since_instant: Vec::new(),
            window_px: grid.size[1] as f64 * grid.cell_px[1],
        };
        for other in others {
            evidence.explain(other);
        }
        evidence.maxima = (0..N).map(|joint| evidence.highest(joint)).collect();
        Some(evidence)
    }

    /// Takes what another person explains.
    fn explain(&mut self, other: &Sighting) {
        for joint in 0..N {
            // Either side of a pair may be taken for the other.
            let pair = SIDES.into_iter().find(|pair| pair.contains(&joint));
            let [first, second] = pair.unwrap_or([joint; 2]);
            let sides = [first, second];
            for named in &sides[..if first == second { 1 } else { 2 }] {
                let Some(at) = other.joint(*named) else {
                    continue;
                };
                let own = self.settings.heat(self.maps.at(joint, at));
                if own >= LEAST_HEAT && f64::from(other.heats[*named]) > own {
                    self.explained[joint].push(at);
                }
            }
        }
    }

    /// The evidence of a place, less what others explain.
    fn left(&self, joint: usize, point: [f64; 2], evidence: f32) -> f32 {
        let explained = &self.explained[joint];
        if explained.is_empty() {
            return evidence;
        }
        let grid = self.maps.grid();
        let left = explained.iter().fold(1.0, |left, at| {
            let [x, y] = [0, 1].map(|axis| (point[axis] - at[axis]) / grid.cell_px[axis]);
            let away = (x * x + y * y) / EXPLAINED_CELLS.powi(2);
            left * (1.0 - (-away / 2.0).exp())
        });
        self.settings.evidence(left * self.settings.heat(evidence))
    }

    /// The highest maxima of a joint's map.
    fn highest(&self, joint: usize) -> Vec<([f64; 2], f32)> {
        let is_near = |at: [f64; 2]| is_within(self.near, at);
        if self.explained[joint].is_empty() {
            return self.maps.maxima(joint, N_MAXIMA, is_near);
        }
        let all = self.maps.maxima(joint, usize::MAX, is_near).into_iter();
        let mut all: Vec<([f64; 2], f32)> = all
            .map(|(at, evidence)| (at, self.left(joint, at, evidence)))
            .filter(|(_, evidence)| self.settings.heat(*evidence) >= LEAST_HEAT)
            .collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all.truncate(N_MAXIMA);
        all
    }

    /// Moves all that it shows to the instant of the frame.
    ///
    /// * `since_instant`: by joint.
    pub(crate) fn move_to_instant(&mut self, since_instant: Vec<Vector2<f64>>) {
        for (maxima, by) in self.maxima.iter_mut().zip(&since_instant) {
            for (at, _) in maxima {
                *at = [at[0] - by.x, at[1] - by.y];
            }
        }
        self.since_instant = since_instant;
    }
}

fn is_within([left, top, right, bottom]: [f64; 4], [x, y]: [f64; 2]) -> bool {
    (left..=right).contains(&x) && (top..=bottom).contains(&y)
}

impl JointEvidence for PersonEvidence<'_> {
    fn at(&self, joint: usize, mut point: [f64; 2]) -> f32 {
        if let Some(by) = self.since_instant.get(joint) {
            point = [point[0] + by.x, point[1] + by.y];
        }
        if !is_within(self.near, point) {
            return self.maps.floor();
        }
        self.left(joint, point, self.maps.at(joint, point))
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        &self.maxima[joint]
    }

    fn floor(&self) -> f32 {
        self.maps.floor()
    }
}

#[cfg(test)]
mod tests {
    use posenetwork::MapGrid;

    use super::*;

    const GRID: MapGrid = MapGrid {
        first_px: [0.0; 2],
        cell_px: [4.0; 2],
        size: [48, 64],
    };
    /// A knee on the right; the elbow of the same person is elsewhere.
    const KNEE: usize = 1;

    /// Maps with a bump of the knee at places in cells, each with its heat.
    fn values(bumps: &[([f64; 2], f64)]) -> Vec<f32> {
        let settings = MapSettings::default();
        let mut values = vec![settings.floor(); GRID.n_values()];
        for cell in 0..GRID.area() {
            let at = [(cell % 48) as f64, (cell / 48) as f64];
            let heat = bumps.iter().map(|(middle, heat)| {
                let away = (at[0] - middle[0]).powi(2) + (at[1] - middle[1]).powi(2);
                heat * (-away / 8.0).exp()
            });
            values[KNEE * GRID.area() + cell] = settings.evidence(heat.sum());
        }
        values
    }

    fn sighting(cell: [f64; 2], heat: f32) -> Sighting {
        let mut sighting = Sighting::new(&[], 0.0);
        // Head and foot give the person a height.
        for (joint, at) in [
            (13, [80.0, 10.0]),
            (0, [90.0, 240.0]),
            (KNEE, GRID.place(cell)),
        ] {
            sighting.joints[joint] = Some(at.map(|side| side as f32));
            sighting.heats[joint] = heat;
        }
        sighting
    }

    #[test]
    fn what_another_shows_more_clearly_is_not_this_ones() {
        let (own, others) = ([20.0, 40.0], [28.0, 42.0]);
        let values = values(&[(own, 0.4), (others, 0.6)]);
        let settings = MapSettings::default();
        let maps = PersonMaps::new(GRID, &values, settings.floor());
        let me = sighting(others, 0.6);
        let seen = |other: &Sighting| {
            let evidence = PersonEvidence::new(maps, &me, &[other], settings).unwrap();
            let heat = |cell: [f64; 2]| settings.heat(evidence.at(KNEE, GRID.place(cell)));
            let best = evidence.maxima(KNEE)[0].0;
            ([heat(own), heat(others)], GRID.cell(best).map(f64::round))
        };
        let ([at_own, at_others], best) = seen(&sighting(others, 0.9));
        assert!(at_own > 0.35 && at_others < 0.05, "{at_own} {at_others}");
        assert_eq!(best, own);
        // One who shows it less clearly explains nothing.
        let ([_, at_others], best) = seen(&sighting(others, 0.5));
        assert!(at_others > 0.55, "{at_others}");
        assert_eq!(best, others);
    }
}
