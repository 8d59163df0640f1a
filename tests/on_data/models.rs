//! Tests that the released models, type tables and expected errors match their descriptions.

use std::fs;
use std::path::PathBuf;

use fmp::Model;
use fmp::files::{self, ModelSummary, describe, mat, own, text};
use multiview::Compatibility;
use viewquality::{Predictor, Selection, Table, Tau, TrainingErrors};

use crate::shared_dir;

const MODELS: [&str; 3] = ["humaneva_fmp.txt", "umpm_fmp.txt", "parse_fmp.mat"];
const SIX_TYPES: [usize; 26] = [6; 26];

fn data(path: &str) -> Option<PathBuf> {
    Some(shared_dir()?.join("data").join(path))
}

fn summary(name: &str) -> Option<ModelSummary> {
    let model = files::read(&data("models")?.join(name)).unwrap();
    Some(describe(&model))
}

fn within(ranges: [f64; 2], low: f64, high: f64) {
    assert!(low <= ranges[0] && ranges[1] <= high, "{ranges:?}");
}

#[test]
#[ignore = "needs ../shared"]
fn the_released_models_have_the_documented_sizes() {
    for (name, side) in MODELS.into_iter().zip([6, 4, 5]) {
        let Some(it) = summary(name) else { return };
        assert_eq!(it.parts.len(), 26);
        assert!(it.parts.iter().all(|part| part.n_types == 6));
        assert_eq!((it.n_filters, it.n_springs, it.n_biases), (156, 150, 900));
        assert_eq!(it.filter_sizes, [[side, side]]);
        assert_eq!((it.interval, it.cell_px), (10, 4));
        assert_eq!(it.detection_threshold, -1.0);
        assert_eq!(it.parts[18].name, "left wrist");
        assert!(it.has_mirror && !it.springs_per_pair);
        assert_eq!(
            format!("{name}"),
            format!("{}{}", it.name, &name[name.len() - 4..])
        );
    }
}

#[test]
#[ignore = "needs ../shared"]
fn the_released_models_have_the_documented_values() {
    let Some(he) = summary(MODELS[0]) else { return };
    let umpm = summary(MODELS[1]).unwrap();
    let parse = summary(MODELS[2]).unwrap();
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    assert_eq!(
        [he.threshold, he.root_bias].map(rounded),
        [0.991387, -2.514749]
    );
    assert_eq!(
        [umpm.threshold, umpm.root_bias].map(rounded),
        [0.976075, -2.487676]
    );
    assert_eq!((parse.threshold * 1e4).round(), -7045.0);
    let (springs, umpm_springs) = (he.springs.unwrap(), umpm.springs.unwrap());
    within(springs.w[0], 0.01, 0.0185);
    within(springs.w[2], 0.01, 0.032);
    within(umpm_springs.w[0], 0.01, 0.0294);
    within(umpm_springs.w[2], 0.01, 0.0257);
    for linear in [
        springs.w[1],
        springs.w[3],
        umpm_springs.w[1],
        umpm_springs.w[3],
    ] {
        within(linear, -0.035, 0.035);
    }
    // Anchors in the description are counted from 1.
    assert_eq!(springs.anchor, [[-3, 4], [-2, 6]]);
    within(he.bias_range.unwrap(), -0.031, 0.031);
    within(umpm.bias_range.unwrap(), -0.071, 0.071);
}

#[test]
#[ignore = "needs ../shared"]
fn an_imported_model_equals_the_original() {
    for name in MODELS {
        let Some(folder) = data("models") else { return };
        let model = files::read(&folder.join(name)).unwrap();
        let bytes = own::encode(&model).unwrap();
        assert_eq!(Model::new(own::decode(&bytes).unwrap()).unwrap(), model);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("imported.plx");
        files::write(&path, &model).unwrap();
        assert_eq!(files::read(&path).unwrap(), model);
        assert_eq!(fs::read(&path).unwrap(), bytes);
    }
}

#[test]
#[ignore = "needs ../shared"]
fn a_truncated_model_is_refused() {
    for name in MODELS {
        let Some(folder) = data("models") else { return };
        let whole = fs::read(folder.join(name)).unwrap();
        let model = files::read(&folder.join(name)).unwrap();
        let own = own::encode(&model).unwrap();
        for part in 0..50 {
            let kept = &whole[..whole.len() * part / 50];
            let refused = if kept.starts_with(b"MATLAB") {
                mat::parse(kept).is_err()
            } else {
                text::parse(std::str::from_utf8(kept).unwrap()).is_err()
            };
            assert!(refused, "{name} cut at {} bytes", kept.len());
            let refused = own::decode(&own[..own.len() * part / 50]).is_err();
            assert!(refused, "{name}, imported, cut to {part}/50");
        }
    }
}

#[test]
#[ignore = "needs ../shared"]
fn a_model_with_an_inconsistent_header_is_refused() {
    let Some(path) = data("models/umpm_fmp.txt") else {
        return;
    };
    let whole = fs::read_to_string(path).unwrap();
    let error = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        text::parse(&whole.replacen(from, to, 1)).unwrap_err().to_string()
    };
    assert_eq!(
        error("filtersSz 156", "filtersSz 157"),
        "line 8 (token 82160): `filters_w` says number of filters = 156, expected 157"
    );
    let misread = error("filters_w 4 4 32", "filters_w 5 4 32");
    assert!(
        misread.starts_with("line 7 (token 2463): `filters_w` expects a whole number"),
        "{misread}"
    );
    assert_eq!(
        error("len 81373", "len 81374"),
        "line 23 (token 84868): `len` says len = 81374, expected 81373"
    );
}

fn table(name: &str) -> Option<Compatibility> {
    let text = fs::read_to_string(data("ptc")?.join(name)).unwrap();
    Some(Compatibility::parse(&text, &SIX_TYPES).unwrap())
}

#[test]
#[ignore = "needs ../shared"]
fn the_conditional_type_tables_of_a_pair_have_one_joint_distribution() {
    for (there, back, unseen) in [
        ("he_C1wrtC2.csv", "he_C2wrtC1.csv", [0, 2]),
        ("umpm_LwrtR.csv", "umpm_RwrtL.csv", [8, 6]),
    ] {
        let (Some(there), Some(back)) = (table(there), table(back)) else {
            return;
        };
        assert_eq!([there.n_unseen(), back.n_unseen()], unseen);
        let (joint, disagreement) = Compatibility::joint_from_conditionals(&there, &back).unwrap();
        assert!(disagreement < 1e-5, "{disagreement}");
        for part in 0..26 {
            let sum: f64 = (0..36).map(|i| joint.value(part, i / 6, i % 6)).sum();
            assert!((sum - 1.0).abs() < 1e-9, "part {part}: {sum}");
        }
        let conditional = joint.conditional();
        for cell in 0..26 * 36 {
            let (part, first, second) = (cell / 36, cell / 6 % 6, cell % 6);
            let difference =
                conditional.value(part, first, second) - there.value(part, first, second);
            assert!(difference.abs() < 1e-4, "part {part}");
        }
    }
}

#[test]
#[ignore = "needs ../shared"]
fn rows_of_a_type_table_belong_to_the_first_view_of_its_name() {
    let (Some(there), Some(back)) = (table("he_C1wrtC2.csv"), table("he_C2wrtC1.csv")) else {
        return;
    };
    let (joint, _) = Compatibility::joint_from_conditionals(&there, &back).unwrap();
    let path = shared_dir().unwrap().join("reference/multi_view/mvptc_C1_C2.json");
    let run: serde_json::Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let types = |view: &str, part: usize| {
        let found = run["solo"][view]["parts"][part]["type"].as_u64().unwrap();
        found as usize - 1
    };
    let log_likelihood = |rows: &str, cols: &str| -> f64 {
        (0..26)
            .map(|part| joint.value(part, types(rows, part), types(cols, part)).max(1e-4).ln())
            .sum()
    };
    let evidence = log_likelihood("A", "B") - log_likelihood("B", "A");
    assert!(evidence > 5.0, "{evidence} nats");
}

fn predictions() -> Option<Table> {
    let text = fs::read_to_string(data("humaneva/error_predictions_he.csv")?).unwrap();
    Some(Table::parse(&text, 26).unwrap())
}

#[test]
#[ignore = "needs ../shared"]
fn the_released_predictions_are_read_completely() {
    let Some(table) = predictions() else { return };
    assert_eq!(table.n_rows(), 13479);
    let first = table.get("S1", "Box", 6, "C1").unwrap();
    assert_eq!((first[0], first[25]), (8.72203, 7.03801));
    let selection = Selection {
        subject: "S1".to_owned(),
        action: "Walking".to_owned(),
        frame_offset: 80,
        ..Selection::default()
    };
    let predictor = Predictor::from_table(&table, selection, "C2").unwrap();
    assert_eq!(predictor.sigma_px(0), table.get("S1", "Walking", 80, "C2"));
    assert!(predictor.sigma_px(0).is_some());
}

#[test]
#[ignore = "needs ../shared"]
fn the_thresholds_switch_off_the_documented_fraction_of_parts() {
    let Some(path) = data("humaneva/error_predictions_he.csv") else {
        return;
    };
    let table = predictions().unwrap();
    let text = fs::read_to_string(path).unwrap();
    let switched_off = |tau: &Tau| -> f64 {
        let mut off = 0;
        for line in text.lines() {
            let keys: Vec<&str> = line.split(',').take(4).collect();
            let frame = keys[2].parse().unwrap();
            let sigma = table.get(keys[0], keys[1], frame, keys[3]).unwrap();
            off += sigma.iter().zip(tau.px()).filter(|(sigma, tau)| sigma > tau).count();
        }
        100.0 * off as f64 / (26 * table.n_rows()) as f64
    };
    let program = switched_off(&Tau::humaneva());
    let paper = switched_off(&Tau::median_only(&TrainingErrors::HUMANEVA));
    assert!((program - 30.5).abs() < 0.05, "{program} %");
    assert!((paper - 63.0).abs() < 0.5, "{paper} %");
}
