//! Measures how well each part of a pose fits locally.

use crate::{Model, Pose, Responses};

/// Radius of a part's neighbourhood, in cells.
const REACH: usize = 4;

/// How well one part of a pose fits at its position, compared with other positions and types.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LocalScore {
    /// Response of the part's filter at its position.
    pub response: f32,
    /// The response minus a mean response of the same filter: the mean over those of the surrounding 9 x 9 cells that were searched.
    pub contrast: f32,
    /// The response minus the best response of the part's other types at the same position; 0 if the part has only one type.
    pub margin: f32,
}

/// Computes the local scores of a pose, one per part.
///
/// # Panics
///
/// If the evidence belongs to another model, or does not [cover](Responses::covers) the pose.
pub fn local_scores(model: &Model, evidence: &Responses<'_>, pose: &Pose) -> Vec<LocalScore> {
    let level = usize::from(pose.level);
    let window = evidence.window(level);
    let local = |part: usize| {
        let place = pose.parts[part];
        let (row, col) = (
            usize::from(place.y) - window.top,
            usize::from(place.x) - window.left,
        );
        let filters = &model.spec().parts[part].filter_of_type;
        let own = usize::from(place.mixture);
        let at = |filter: usize| evidence.map(level, filter)[row * window.cols + col];
        let response = at(filters[own]);
        let others = filters.iter().enumerate().filter(|other| other.0 != own);
        let best_other = others.map(|other| at(*other.1)).reduce(f32::max);
        let map = evidence.map(level, filters[own]);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in row.saturating_sub(REACH)..(row + REACH + 1).min(window.rows) {
            for x in col.saturating_sub(REACH)..(col + REACH + 1).min(window.cols) {
                sum += map[y * window.cols + x];
                count += 1.0;
            }
        }
        LocalScore {
            response,
            contrast: response - sum / count,
            margin: best_other.map_or(0.0, |best_other| response - best_other),
        }
    };
    (0..pose.parts.len()).map(local).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Edge, Filter, Layout, ModelSpec, N_CHANNELS, PartSpec, Placement, Region, Scope, Spring,
        Springs,
    };

    /// Returns a model with a root of two types, and a child of one type.
    fn model() -> Model {
        let filter = Filter {
            rows: 3,
            cols: 3,
            weights: vec![0.0; 9 * N_CHANNELS],
        };
        let spring = Spring {
            w: [0.01, 0.0, 0.01, 0.0],
            anchor: [0, 1],
        };
        let part = |name: &str, filter_of_type: Vec<usize>, edge| PartSpec {
            name: name.to_owned(),
            filter_of_type,
            edge,
        };
        let edge = Edge {
            parent: 0,
            bias: vec![vec![0.0]; 2],
            springs: Springs::PerChildType(vec![spring]),
        };
        Model::new(ModelSpec {
            name: "two".to_owned(),
            parts: vec![
                part("root", vec![0, 1], None),
                part("child", vec![2], Some(edge)),
            ],
            filters: vec![filter; 3],
            root_bias: 0.0,
            interval: 5,
            cell_px: 4,
            threshold: -1.0,
            mirror: None,
        })
        .unwrap()
    }

    fn pose(root: [u16; 2]) -> Pose {
        let place = |[x, y]: [u16; 2], mixture| Placement { x, y, mixture };
        Pose {
            score: 0.0,
            level: 1,
            parts: vec![place(root, 1), place([7, 8], 0)],
        }
    }

    #[test]
    fn a_part_is_compared_with_its_surroundings_and_its_other_types() {
        let model = model();
        let layout = Layout::new(&model, 160, 120).unwrap();
        let mut values = vec![1.0; layout.n_responses()];
        let at = |filter: usize, x: usize, y: usize| {
            layout.map_range(1, filter).start + y * layout.levels[1].cols + x
        };
        values[at(1, 9, 10)] = 82.0; // the root, of the second type
        values[at(0, 9, 10)] = 80.5;
        values[at(1, 9, 15)] = 1e6; // five cells away
        values[at(2, 7, 8)] = 4.0;
        let levels: Vec<u16> = (0..layout.levels.len() as u16).collect();
        let evidence = Responses::new(&layout, &values, &levels);
        let [root, child] = local_scores(&model, &evidence, &pose([9, 10]))[..] else {
            panic!("two parts");
        };
        assert_eq!(
            (root.response, root.contrast, root.margin),
            (82.0, 80.0, 1.5)
        );
        assert_eq!((child.response, child.margin), (4.0, 0.0));
    }

    #[test]
    fn surroundings_end_at_the_border() {
        let model = model();
        let layout = Layout::new(&model, 160, 120).unwrap();
        let mut values = vec![0.0; layout.n_responses()];
        values[layout.map_range(1, 1).start] = 25.0; // 5 x 5 cells are left
        let levels: Vec<u16> = (0..layout.levels.len() as u16).collect();
        let evidence = Responses::new(&layout, &values, &levels);
        let scores = local_scores(&model, &evidence, &pose([0, 0]));
        assert_eq!((scores[0].response, scores[0].contrast), (25.0, 24.0));
    }

    #[test]
    fn local_scores_are_read_from_the_searched_region() {
        let model = model();
        let layout = Layout::new(&model, 160, 120).unwrap();
        let region = Region {
            x: [20, 120],
            y: [16, 100],
        };
        let scope = Scope::new(&layout, 1..3, region).unwrap();
        let window = layout.window(&scope, 1);
        assert!(window.top > 0 && window.left > 0);
        let mut values = vec![0.0; layout.n_values(&scope)];
        let (x, y) = (10 - window.left, 11 - window.top);
        values[(window.rows + y) * window.cols + x] = 3.0; // filter 1 of the first level
        let evidence = Responses::within(&layout, &values, &[1, 2], scope);
        let scores = local_scores(&model, &evidence, &pose([10, 11]));
        assert_eq!(scores[0].response, 3.0);
    }
}
