//! Writes a model in the authors' text format.

use crate::{Filter, ModelSpec, N_CHANNELS, Spring, Springs};

/// Returns the text of a model whose parts have equally many types and springs per child type.
pub(crate) fn as_text(spec: &ModelSpec) -> String {
    let owned = Owned::new(spec);
    let (n_biases, n_filters) = (owned.biases.len(), spec.filters.len());
    let [rows, cols] = [spec.filters[0].rows, spec.filters[0].cols];
    let len = n_biases + n_filters * rows * cols * N_CHANNELS + 4 * owned.springs.len();
    [
        format!("partsNbr {}\n", spec.parts.len()),
        format!("typesNbr {}\n", n_types(spec)),
        format!("biasSz {n_biases}\n"),
        array("bias_w", [n_biases, 1, 1], &owned.biases),
        array("bias_i", [n_biases, 1, 1], 1..=n_biases),
        format!("filtersSz {n_filters}\n"),
        format!(
            "filters_w {}\n",
            spec.filters.iter().map(planes).collect::<String>()
        ),
        array("filters_i", [n_filters, 1, 1], 1..=n_filters),
        springs(&owned.springs),
        components(spec, &owned),
        array("maxsize", [1, 2, 1], [rows, cols]),
        format!(
            "interval {}\nsbin {}\nlen {len}\n",
            spec.interval, spec.cell_px
        ),
        format!("thresh {}\nobj -1.79769313486232e+308\n", spec.threshold),
    ]
    .concat()
}

/// Entries owned by the parts of a model, and their indices.
struct Owned {
    biases: Vec<f64>,
    bias_ids: Vec<usize>,
    springs: Vec<Spring>,
    spring_ids: Vec<usize>,
}

impl Owned {
    fn new(spec: &ModelSpec) -> Self {
        let (n_parts, n_types) = (spec.parts.len(), n_types(spec));
        let mut owned = Self {
            biases: vec![spec.root_bias],
            bias_ids: vec![0; n_types * n_types * n_parts],
            springs: Vec::new(),
            spring_ids: vec![0; n_parts * n_types],
        };
        owned.bias_ids[0] = 1;
        for (part_idx, part) in spec.parts.iter().enumerate() {
            let Some(edge) = &part.edge else { continue };
            for (parent, row) in edge.bias.iter().enumerate() {
                for (own, &bias) in row.iter().enumerate() {
                    owned.biases.push(bias);
                    owned.bias_ids[(part_idx * n_types + own) * n_types + parent] =
                        owned.biases.len();
                }
            }
            if let Springs::PerChildType(all) = &edge.springs {
                for (own, &spring) in all.iter().enumerate() {
                    owned.springs.push(spring);
                    owned.spring_ids[own * n_parts + part_idx] = owned.springs.len();
                }
            }
        }
        owned
    }
}

fn n_types(spec: &ModelSpec) -> usize {
    spec.parts[0].filter_of_type.len()
}

fn planes(filter: &Filter) -> String {
    let mut values = Vec::new();
    for channel in 0..N_CHANNELS {
        for col in 0..filter.cols {
            for row in 0..filter.rows {
                values.push(filter.weights[(row * filter.cols + col) * N_CHANNELS + channel]);
            }
        }
    }
    format!(
        "{} {} {N_CHANNELS} {}",
        filter.rows,
        filter.cols,
        listed(values)
    )
}

fn springs(springs: &[Spring]) -> String {
    let n_springs = springs.len();
    let weights = (0..4).flat_map(|i| springs.iter().map(move |spring| spring.w[i]));
    let anchors = (0..3).flat_map(|axis| {
        let of = move |anchor: [i32; 2]| anchor.get(axis).map_or(0, |anchor| anchor + 1);
        springs.iter().map(move |spring| of(spring.anchor))
    });
    [
        format!("defsSz {n_springs}\n"),
        array("defs_w", [n_springs, 4, 1], weights),
        array("defs_i", [n_springs, 1, 1], 1..=n_springs),
        array("defs_anchor", [n_springs, 3, 1], anchors),
    ]
    .concat()
}

fn components(spec: &ModelSpec, owned: &Owned) -> String {
    let (n_parts, n_types) = (spec.parts.len(), n_types(spec));
    let filter_ids = (0..n_types)
        .flat_map(|own| spec.parts.iter().map(move |part| part.filter_of_type[own] + 1));
    let parents = spec
        .parts
        .iter()
        .map(|part| part.edge.as_ref().map_or(0, |edge| edge.parent + 1));
    [
        format!("componentsNbr 1\ncomponentSz {n_parts}\n"),
        array(
            "components_biasid",
            [n_types, n_types, n_parts],
            &owned.bias_ids,
        ),
        array("components_filterid", [n_parts, n_types, 1], filter_ids),
        array("components_defid", [n_parts, n_types, 1], &owned.spring_ids),
        array("components_parent", [n_parts, 1, 1], parents.clone()),
        array("pa", [1, n_parts, 1], parents),
    ]
    .concat()
}

fn array<T: ToString>(
    name: &str,
    [rows, cols, planes]: [usize; 3],
    values: impl IntoIterator<Item = T>,
) -> String {
    format!("{name} {rows} {cols} {planes} {}\n", listed(values))
}

fn listed<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    let values: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
    values.join(" ") + " "
}
