//! The tree for people who lie, or stand on their hands: its springs turned by quarters.

use std::sync::Arc;

use fmp::{Model, Solver, Spring, Springs};

use crate::network::Turn;

/// Solvers of a tree, for each way in which the head of a person may point in the picture.
#[derive(Debug)]
pub struct TurnedSprings([Solver; 4]);

impl TurnedSprings {
    /// Turns the springs of a tree of upright people.
    pub fn new(model: &Arc<Model>) -> Self {
        Self(Turn::ALL.map(|it| Solver::new(turned(model, it))))
    }

    /// The solver for people whose heads point somewhere.
    pub fn of(&self, turn: Turn) -> &Solver {
        &self.0[turn as usize]
    }

    /// The tree of upright people. The trees of the others have the same parts, types and filters.
    pub fn model(&self) -> &Arc<Model> {
        self.of(Turn::Up).model()
    }
}

fn turned(model: &Arc<Model>, turn: Turn) -> Arc<Model> {
    let mut spec = model.spec().clone();
    let edges = spec.parts.iter_mut().filter_map(|it| it.edge.as_mut());
    for springs in edges.map(|it| &mut it.springs) {
        let all: Vec<&mut Spring> = match springs {
            Springs::PerChildType(all) => all.iter_mut().collect(),
            Springs::PerTypePair(all) => all.iter_mut().flatten().flatten().collect(),
        };
        for it in all {
            *it = turned_spring(*it, turn);
        }
    }
    // A tree stays one when its springs are turned.
    Model::new(spec).map_or_else(|_| Arc::clone(model), Arc::new)
}

/// A spring for `d' = R d`, with `R` the rotation that turns upward to where the head points.
fn turned_spring(it: Spring, turn: Turn) -> Spring {
    let ([xx, x, yy, y], [across, down]) = (it.w, it.anchor);
    match turn {
        Turn::Up => it,
        Turn::Right => Spring {
            w: [yy, -y, xx, x],
            anchor: [-down, across],
        },
        Turn::Down => Spring {
            w: [xx, -x, yy, -y],
            anchor: [-across, -down],
        },
        Turn::Left => Spring {
            w: [yy, y, xx, -x],
            anchor: [down, -across],
        },
    }
}

#[cfg(test)]
mod tests {
    use fmp::{Layout, Responses, Scope};
    use skeleton::PARSE14;

    use super::*;
    use crate::maps::N_JOINTS;
    use crate::springs::tests::people;
    use crate::springs::{SpringSettings, learn};

    /// A point about the middle of the picture, turned.
    fn rotated([x, y]: [f64; 2], turn: Turn) -> [f64; 2] {
        let [x, y] = [x - 32.0, y - 32.0];
        let [x, y] = match turn {
            Turn::Up => [x, y],
            Turn::Right => [-y, x],
            Turn::Down => [-x, -y],
            Turn::Left => [y, -x],
        };
        [x + 32.0, y + 32.0]
    }

    /// The score of the best pose of a person who is seen without one joint, and how far that joint is off.
    fn solved(springs: &TurnedSprings, person: Turn, by: Turn) -> (f32, f64) {
        let layout = Layout::new(springs.model(), 160, 160).unwrap();
        let scope = Scope::new(&layout, 0..1, Scope::whole(&layout).region()).unwrap();
        let window = layout.window(&scope, 0);
        let area = window.rows * window.cols;
        let mut values = vec![0.0; layout.n_values(&scope)];
        let truth = people()[3].map(|it| rotated(it, person));
        let hidden = 10;
        for joint in (0..N_JOINTS).filter(|it| *it != hidden) {
            let map = &mut values[joint * area..(joint + 1) * area];
            map.fill(-4.0);
            map[(truth[joint][1] as usize + 8) * window.cols + truth[joint][0] as usize + 8] = 0.0;
        }
        let evidence = Responses::within(&layout, &values, &[0], scope);
        let pose = springs.of(by).best(&evidence, None).unwrap();
        let at = pose.parts[PARSE14.joints[hidden].parts[0]];
        let off = [
            f64::from(at.x) - 8.0 - truth[hidden][0],
            f64::from(at.y) - 8.0 - truth[hidden][1],
        ];
        (pose.score, off[0].hypot(off[1]))
    }

    #[test]
    fn who_is_turned_is_held_as_who_stands() {
        let model = Arc::new(learn(&people(), &SpringSettings::default()).unwrap());
        let springs = TurnedSprings::new(&model);
        let (upright, off) = solved(&springs, Turn::Up, Turn::Up);
        assert!(off < 6.0, "{off}");
        for turn in [Turn::Right, Turn::Down, Turn::Left] {
            let (score, off) = solved(&springs, turn, turn);
            // Places are whole cells: the same to what half a cell costs.
            assert!(
                (score - upright).abs() < 0.1 * upright.abs() + 0.5,
                "{turn:?}: {score} {upright}"
            );
            assert!(off < 7.0, "{turn:?}: {off}");
            let (wrong, _) = solved(&springs, turn, Turn::Up);
            assert!(wrong < score - 1.0, "{turn:?}: {wrong} {score}");
        }
    }
}
