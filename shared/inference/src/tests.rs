//! Compares networks run by Parallax itself with `rten`, and tests which networks `rten` runs alone.

use crate::onnx::{Attribute, Network, Side};
use proptest::prelude::*;

use crate::{Input, RunBy, RunError, Session, Values};

const SHIPPED: &[u8] = include_bytes!("../../../configs/models/person.pose.onnx");

/// Pseudo-random numbers.
fn noise(n: usize, seed: u32) -> Vec<f32> {
    let mut state = u64::from(seed) << 1 | 1;
    let next = |_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
        (state >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    (0..n).map(next).collect()
}

/// All outputs for a picture of random noise.
fn run(session: &Session, shape: &[usize], seed: u32) -> Result<Vec<Vec<f32>>, RunError> {
    let description = session.description();
    let picture = noise(shape.iter().product(), seed);
    let input = Input {
        name: &description.inputs[0].name,
        shape,
        values: Values::F32(&picture),
    };
    let names = description.outputs.iter().map(|port| port.name.as_str());
    let names: Vec<&str> = names.collect();
    let mut outputs = vec![Vec::new(); names.len()];
    session.run(&[input], &names, &mut |output| {
        outputs[output.index] = output.values.unwrap().to_vec();
    })?;
    Ok(outputs)
}

/// The largest difference as a share of the largest value.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    let largest = |values: &mut dyn Iterator<Item = f32>| values.map(f32::abs).fold(0.0, f32::max);
    largest(&mut a.iter().zip(b).map(|(a, b)| a - b)) / largest(&mut b.iter().copied()).max(1e-6)
}

fn assert_like_rten(file: &[u8], shape: &[usize], seed: u32) -> RunBy {
    let [own, rten] = [Session::parse, Session::parse_by_rten].map(|parse| {
        let session = parse(file.to_vec()).unwrap();
        let outputs = run(&session, shape, seed).unwrap();
        // Reused memory gives the same result.
        assert_eq!(outputs, run(&session, shape, seed).unwrap());
        (session.run_by().clone(), outputs)
    });
    for (own, rten) in own.1.iter().zip(&rten.1) {
        assert!(difference(own, rten) < 1e-4, "{own:?} {rten:?}");
    }
    own.0
}

#[test]
fn the_included_network_runs_in_parallax_and_gives_the_results_of_rten() {
    for seed in 0..3 {
        let by = assert_like_rten(SHIPPED, &[1, 3, 160, 128], seed);
        assert_eq!(by, RunBy::Parallax);
    }
}

#[test]
fn batches_of_pictures_are_run_by_rten() {
    let session = Session::parse(SHIPPED.to_vec()).unwrap();
    let outputs = run(&session, &[2, 3, 160, 128], 1).unwrap();
    assert_eq!(outputs[0].len(), 2 * 19 * 40 * 32);
}

/// A network under construction.
struct Net {
    net: Network,
    seed: u32,
}

impl Net {
    fn new(sides: [usize; 3]) -> Self {
        let mut net = Network::default();
        let sides = sides.map(Side::Fixed);
        let shape = [Side::Named("n")].into_iter().chain(sides).collect();
        net.inputs.push(("picture".to_owned(), shape));
        Self { net, seed: 1 }
    }

    fn conv(&mut self, from: &str, to: &str, channels: [usize; 2], (side, stride): (usize, i64)) {
        let [inputs, outputs] = channels;
        let names = ["weight", "bias"].map(|what| format!("{to}.{what}"));
        let n = outputs * inputs * side * side;
        let scale = 1.5 / ((inputs * side * side) as f32).sqrt();
        self.seed += 1;
        let weights = noise(n, self.seed).iter().map(|weight| weight * scale).collect();
        self.net.floats(&names[0], &[outputs, inputs, side, side], weights);
        self.net.floats(&names[1], &[outputs], noise(outputs, self.seed + 7));
        let attributes = vec![
            ("kernel_shape", Attribute::Ints(vec![side as i64; 2])),
            ("strides", Attribute::Ints(vec![stride; 2])),
            ("pads", Attribute::Ints(vec![side as i64 / 2; 4])),
        ];
        self.net.node("Conv", &[from, &names[0], &names[1]], to, attributes);
    }

    fn node(&mut self, op: &str, from: &[&str], to: &str) {
        self.net.node(op, from, to, vec![]);
    }

    fn file(mut self, outputs: &[&str]) -> Vec<u8> {
        for name in outputs {
            let shape = ["n", "c", "h", "w"].map(Side::Named).to_vec();
            self.net.outputs.push(((*name).to_owned(), shape));
        }
        self.net.file()
    }
}

/// A residual block at half the size, whose result is added to the values at full size. Both are also used without the sum, and the last
/// operation is a sigmoid.
fn residual(
    [inputs, narrow, wide]: [usize; 3],
    sides: [usize; 2],
    is_last_needed: bool,
) -> Vec<u8> {
    let mut net = Net::new([inputs, 2 * sides[0], 2 * sides[1]]);
    net.conv("picture", "full", [inputs, wide], (3, 1));
    net.node("Relu", &["full"], "full.relu");
    net.conv("full.relu", "half", [wide, wide], (3, 2));
    net.node("Relu", &["half"], "half.relu");
    net.conv("half.relu", "narrow", [wide, narrow], (1, 1));
    net.node("Relu", &["narrow"], "narrow.relu");
    net.conv("narrow.relu", "inner", [narrow, narrow], (3, 1));
    net.conv("inner", "widen", [narrow, wide], (1, 1));
    net.node("Add", &["widen", "half"], "sum");
    net.net.floats("scales", &[4], vec![1.0, 1.0, 2.0, 2.0]);
    net.node("Resize", &["sum", "", "scales"], "up");
    net.node("Add", &["up", "full"], "top");
    net.node("Relu", &["top"], "top.relu");
    net.node("Sigmoid", &["top.relu"], "end");
    net.node("Resize", &["half", "", "scales"], "alone");
    let outputs: &[&str] = if is_last_needed {
        &["end", "alone", "top", "sum"]
    } else {
        &["top.relu"]
    };
    net.file(outputs)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn other_networks_give_the_same_results_as_rten(
        inputs in 1..5_usize, narrow in 1..20_usize, wide in 1..40_usize,
        rows in 1..9_usize, cols in 1..9_usize, is_last_needed: bool, seed: u32,
    ) {
        let file = residual([inputs, narrow, wide], [rows, cols], is_last_needed);
        let by = assert_like_rten(&file, &[1, inputs, 2 * rows, 2 * cols], seed);
        prop_assert_eq!(by, RunBy::Parallax);
    }
}

fn reason(file: &[u8]) -> String {
    let by = assert_like_rten(file, &[1, 4, 6, 6], 5);
    assert!(matches!(by, RunBy::Rten(_)), "{by}");
    by.to_string()
}

#[test]
fn networks_with_unknown_operations_are_run_by_rten_and_the_operation_is_named() {
    let mut net = Net::new([4, 6, 6]);
    net.conv("picture", "a", [4, 4], (3, 1));
    net.node("Sigmoid", &["a"], "b");
    net.conv("b", "c", [4, 4], (3, 1));
    let error = reason(&net.file(&["c"]));
    assert_eq!(
        error,
        "rten, since node \"b\" (Sigmoid): this operation is not supported"
    );

    let mut net = Net::new([4, 6, 6]);
    net.net.floats("w", &[4, 1, 3, 3], noise(36, 3));
    let kernel = ("kernel_shape", Attribute::Ints(vec![3; 2]));
    let groups = vec![kernel, ("group", Attribute::Int(4))];
    net.net.node("Conv", &["picture", "w"], "a", groups);
    let error = reason(&net.file(&["a"]));
    assert_eq!(
        error,
        "rten, since node \"a\" (Conv): convolutions in groups are not supported"
    );

    let mut net = Net::new([4, 6, 6]);
    net.node("Relu", &["picture"], "a");
    assert_eq!(
        reason(&net.file(&["a"])),
        "rten, since the network has no convolution"
    );
}

#[test]
fn weights_that_do_not_fit_the_input_are_an_error() {
    let mut net = Net::new([4, 6, 6]);
    net.conv("picture", "a", [5, 4], (3, 1));
    let session = Session::parse(net.file(&["a"])).unwrap();
    let by = session.run_by().to_string();
    assert!(
        by.ends_with("(Conv): the shape of the layer does not match its input"),
        "{by}"
    );
    run(&session, &[1, 4, 6, 6], 1).unwrap_err();
}

#[test]
fn a_truncated_network_file_is_refused() {
    let file = residual([3, 4, 5], [4, 4], true);
    for n in (0..file.len()).step_by(97) {
        // Loading a truncated file must never panic, but may succeed.
        if let Ok(session) = Session::parse(file[..n].to_vec()) {
            assert_ne!(session.run_by(), &RunBy::Parallax);
        }
    }
}
