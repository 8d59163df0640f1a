//! A model as the `model` struct of release 1.3 or 1.4.

use testkit::mat::{Mat, number, row};

use crate::{ModelSpec, N_CHANNELS, PartSpec, Springs};

/// Returns the `model` struct of release 1.4 (springs per pair, 0 if a pair never occurs) or 1.3.
pub(crate) fn model(spec: &ModelSpec) -> Mat {
    let (mut biases, mut springs) = (vec![spec.root_bias], Vec::new());
    let components = spec
        .parts
        .iter()
        .flat_map(|part| component(part, &mut biases, &mut springs))
        .collect();
    let parents = spec.parts.iter().map(parent_id).collect();
    let filters = spec.filters.iter().flat_map(|filter| {
        let weight = move |at: usize| {
            let (row, col) = (at % filter.rows, at / filter.rows % filter.cols);
            filter.weights[(row * filter.cols + col) * N_CHANNELS + at / filter.rows / filter.cols]
        };
        let values = (0..filter.weights.len()).map(weight).collect();
        [
            Mat::Numbers(vec![filter.rows, filter.cols, N_CHANNELS], values),
            number(1.0),
        ]
    });
    let [rows, cols] = [spec.filters[0].rows, spec.filters[0].cols];
    let biases = biases.into_iter().flat_map(|bias| [number(bias), number(1.0)]);
    let fields = [
        ("bias", Mat::Structs(vec!["w", "i"], biases.collect())),
        ("filters", Mat::Structs(vec!["w", "i"], filters.collect())),
        ("defs", Mat::Structs(vec!["w", "i", "anchor"], springs)),
        (
            "components",
            Mat::Cell(vec![Mat::Structs(
                vec!["biasid", "filterid", "defid", "parent"],
                components,
            )]),
        ),
        ("pa", row(parents)),
        ("maxsize", row(vec![rows as f64, cols as f64])),
        ("interval", number(spec.interval as f64)),
        ("sbin", number(spec.cell_px as f64)),
        ("thresh", number(spec.threshold)),
    ];
    let (names, values) = fields.into_iter().unzip();
    Mat::Structs(names, values)
}

/// Returns `biasid`, `filterid`, `defid` and `parent` of a part.
fn component(part: &PartSpec, biases: &mut Vec<f64>, springs: &mut Vec<Mat>) -> [Mat; 4] {
    let filter_ids = part
        .filter_of_type
        .iter()
        .map(|&filter_of_type| filter_of_type as f64 + 1.0)
        .collect();
    let Some(edge) = &part.edge else {
        let nothing = Mat::Numbers(vec![0, 0], vec![]);
        return [number(1.0), row(filter_ids), nothing, number(0.0)];
    };
    let (n_parent, n_own) = (edge.bias.len(), part.filter_of_type.len());
    let mut bias_ids = vec![0.0; n_parent * n_own];
    let mut spring_ids = vec![0.0; n_parent * n_own];
    let mut add_spring = |spring: &crate::Spring| {
        let anchor = [spring.anchor[0] + 1, spring.anchor[1] + 1, 0].map(f64::from);
        springs.extend([row(spring.w.to_vec()), number(1.0), row(anchor.to_vec())]);
        (springs.len() / 3) as f64
    };
    for own in 0..n_own {
        for parent in 0..n_parent {
            let at = own * n_parent + parent;
            if edge.bias[parent][own].is_finite() {
                biases.push(edge.bias[parent][own]);
                bias_ids[at] = biases.len() as f64;
            }
            if let Springs::PerTypePair(all) = &edge.springs {
                spring_ids[at] = all[parent][own].as_ref().map_or(0.0, &mut add_spring);
            }
        }
    }
    let spring_ids = match &edge.springs {
        Springs::PerChildType(all) => row(all.iter().map(add_spring).collect()),
        Springs::PerTypePair(_) => Mat::Numbers(vec![n_parent, n_own], spring_ids),
    };
    let bias_ids = Mat::Numbers(vec![n_parent, n_own], bias_ids);
    [
        bias_ids,
        row(filter_ids),
        spring_ids,
        number(parent_id(part)),
    ]
}

fn parent_id(part: &PartSpec) -> f64 {
    part.edge.as_ref().map_or(0.0, |edge| edge.parent as f64 + 1.0)
}
