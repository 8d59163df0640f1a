//! Tests every operation: its gradient must match the change of its output, and the written file must give the same values.

use fastrand::Rng;

use crate::networks::compute::Computer;
use crate::networks::lesson::{Lesson, Running, Shown};
use crate::networks::onnx::{Document, write};
use crate::networks::ops::{Conv, Dims, Network, Ops, Output, Places, Scaling};
use crate::networks::parameters::{Parameter, Role, initial, normal};
use crate::networks::settings::{Backend, Precision};

const COMPUTER: Computer = Computer {
    backend: Backend::BuiltIn,
    precision: Precision::F32,
};

/// A network of one operation between trainable layers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum One {
    Convolution(Conv),
    Relu,
    Add,
    Doubled,
    Pool,
    Mean,
    Highest,
    Fixed,
    Softmax,
    Around,
    Place,
    Join,
    JoinMaps,
    Centred,
    Prelu,
    Dropout,
}

const CONV: Conv = Conv {
    channels: 6,
    kernel: 3,
    stride: 1,
    by_channel: false,
    scaling: Scaling::Plain,
};

/// All operations, and all kinds of convolutions.
fn all() -> Vec<One> {
    let mut all = vec![
        One::Relu,
        One::Add,
        One::Doubled,
        One::Pool,
        One::Mean,
        One::Highest,
        One::Fixed,
        One::Softmax,
        One::Around,
        One::Place,
        One::Join,
        One::JoinMaps,
        One::Centred,
        One::Prelu,
        One::Dropout,
    ];
    for scaling in [
        Scaling::Plain,
        Scaling::Standardised { gain: 0.7 },
        Scaling::Batch,
    ] {
        for (kernel, stride) in [(1, 1), (3, 1), (3, 2), (1, 2), (5, 3)] {
            for by_channel in [false, true] {
                all.push(One::Convolution(Conv {
                    kernel,
                    stride,
                    by_channel,
                    scaling,
                    ..CONV
                }));
            }
        }
    }
    all
}

const PLACES: [usize; 2] = [1, 3];

impl Network for One {
    fn inputs(&self) -> Vec<(&'static str, Dims)> {
        vec![("map", vec![3, 6, 9]), ("list", vec![4])]
    }

    fn outputs(&self) -> Vec<Output> {
        let output = |name, is_logarithm| Output { name, is_logarithm };
        vec![output("first", false), output("second", true)]
    }

    fn run<O: Ops>(&self, ops: &mut O) -> Vec<O::Value> {
        let map = ops.input("map");
        let list = ops.input("list");
        let map = ops.conv(&map, "map", CONV);
        let hidden = ops.dense(&list, "list", 5);
        let value = match *self {
            Self::Convolution(conv) => ops.conv(&map, "conv", conv),
            Self::Relu => ops.relu(&map),
            Self::Add => ops.add(&map, &map),
            Self::Doubled => ops.doubled(&map),
            Self::Pool => ops.pool(&map),
            Self::Mean => ops.mean(&map),
            Self::Highest => ops.highest(&map),
            Self::Fixed => ops.fixed(&map),
            Self::Softmax => {
                let weights = ops.softmax(&map, 1.5);
                ops.look(&map, &weights)
            }
            Self::Around => {
                let places = Places {
                    x: PLACES.to_vec(),
                    y: vec![0, 2],
                    width: 1.5,
                    deviation: 0.8,
                };
                let weights = ops.around(&list, &map, &places);
                ops.look(&map, &weights)
            }
            Self::Place => {
                let weights = ops.softmax(&map, 0.5);
                ops.place(&weights)
            }
            Self::Join => ops.join(&[&list, &hidden, &hidden]),
            Self::JoinMaps => {
                let positive = ops.relu(&map);
                ops.join(&[&map, &positive])
            }
            Self::Centred => ops.centred(&hidden, "centred"),
            Self::Prelu => ops.prelu(&hidden, "slope"),
            Self::Dropout => ops.dropout(&hidden, 0.3),
        };
        let is_map = !matches!(
            self,
            Self::Mean
                | Self::Highest
                | Self::Softmax
                | Self::Around
                | Self::Place
                | Self::Join
                | Self::Centred
                | Self::Prelu
                | Self::Dropout
        );
        let flat = if is_map { ops.flat(&value) } else { value };
        let last = ops.dense(&flat, "last", 6);
        vec![last, flat]
    }
}

fn numbers(n: usize, dice: &mut Rng) -> Vec<f32> {
    (0..n).map(|_| 0.7 * normal(dice)).collect()
}

fn shown(network: &One, n: usize) -> Shown {
    let mut dice = Rng::with_seed(2);
    let inputs = network.inputs().into_iter();
    let inputs = inputs.map(|(_, dims)| numbers(n * dims.iter().product::<usize>(), &mut dice));
    Shown {
        n,
        inputs: inputs.collect(),
    }
}

/// Parameters that differ from the initial values. Many of the initial values are equal.
fn parameters(network: &One) -> Vec<Parameter> {
    let mut dice = Rng::with_seed(5);
    let mut all = initial(network, 7);
    for parameter in &mut all {
        for value in &mut parameter.values {
            let by = 0.2 * (dice.f32() - 0.5);
            *value += if parameter.role == Role::Fixed {
                by.abs()
            } else {
                by
            };
        }
    }
    all
}

/// Cost and gradients, where the cost is the sum of the outputs with random factors.
fn lesson(network: &One, parameters: &[Parameter], shown: &Shown) -> (f64, Lesson) {
    lesson_by(COMPUTER, network, (parameters, shown))
}

fn lesson_by(
    computer: Computer,
    network: &One,
    (parameters, shown): (&[Parameter], &Shown),
) -> (f64, Lesson) {
    let learned: Vec<bool> =
        parameters.iter().map(|parameter| parameter.role != Role::Fixed).collect();
    let running = Running {
        parameters,
        learned: &learned,
        dice: Rng::with_seed(11),
    };
    let mut cost = 0.0;
    let lesson = computer.learn(network, running, shown, &mut |outputs| {
        let mut dice = Rng::with_seed(13);
        let mut gradients = Vec::new();
        for output in outputs {
            let factors = numbers(output.len(), &mut dice);
            let each = output.iter().zip(&factors);
            cost += each.map(|(value, factor)| f64::from(*value) * f64::from(*factor)).sum::<f64>();
            gradients.push(factors);
        }
        gradients
    });
    (cost, lesson)
}

#[test]
fn the_gradient_of_every_operation_equals_finite_differences() {
    let step = 2e-3;
    for network in all() {
        let shown = shown(&network, 3);
        let mut parameters = parameters(&network);
        let gradients = lesson(&network, &parameters, &shown).1.gradients;
        for at in 0..parameters.len() {
            let is_fixed = parameters[at].role == Role::Fixed;
            let Some(gradient) = &gradients[at] else {
                // A fixed value has no gradient, and a list does not depend on the map.
                let name = parameters[at].name.clone();
                assert!(is_fixed || name != "last.weight", "{network:?}: {name}");
                continue;
            };
            assert!(!is_fixed, "{network:?}");
            let (mut off, mut length) = (0.0, 0.0);
            let every = gradient.len() / 64 + 1;
            for (place, gradient) in gradient.iter().enumerate().step_by(every) {
                let value = parameters[at].values[place];
                let mut moved = |to: f32| {
                    parameters[at].values[place] = to;
                    lesson(&network, &parameters, &shown).0
                };
                let change = (moved(value + step) - moved(value - step)) / f64::from(2.0 * step);
                moved(value);
                off += (change - f64::from(*gradient)).powi(2);
                length += change.powi(2);
            }
            let share = off.sqrt() / length.sqrt().max(0.1);
            let name = &parameters[at].name;
            // Some finite differences cross a point where an operation is not differentiable.
            assert!(share < 0.02, "{network:?}: {name} is {share} off");
        }
    }
}

#[test]
fn every_operation_on_the_path_to_the_map_passes_gradients() {
    for network in all() {
        let sees_map = !matches!(
            network,
            One::Fixed | One::Join | One::Centred | One::Prelu | One::Dropout
        );
        let gradients = lesson(&network, &parameters(&network), &shown(&network, 2)).1.gradients;
        assert_eq!(gradients[0].is_some(), sees_map, "{network:?}");
    }
}

#[test]
fn the_onnx_file_of_every_operation_gives_the_same_values() {
    for network in all() {
        let shown = shown(&network, 2);
        let parameters = parameters(&network);
        let found = COMPUTER.find(&network, &parameters, &shown);
        let file = write(&network, &parameters, Document::default());
        let session = inference::Session::parse(file).unwrap();
        let shapes: Vec<(&str, Vec<usize>)> = network
            .inputs()
            .into_iter()
            .map(|(name, dims)| (name, [vec![2], dims].concat()))
            .collect();
        let inputs: Vec<inference::Input<'_>> = shapes
            .iter()
            .zip(&shown.inputs)
            .map(|((name, shape), values)| inference::Input {
                name,
                shape,
                values: inference::Values::F32(values),
            })
            .collect();
        let mut outputs = [Vec::new(), Vec::new()];
        session
            .run(&inputs, &["first", "second"], &mut |output| {
                outputs[output.index] = output.values.unwrap().to_vec();
            })
            .unwrap();
        let expected = [
            found[0].clone(),
            found[1].iter().map(|value| value.exp()).collect(),
        ];
        for (got, expected) in outputs.iter().zip(&expected) {
            assert_eq!(got.len(), expected.len(), "{network:?}");
            for (got, expected) in got.iter().zip(expected) {
                let off = (got - expected).abs();
                assert!(
                    off < 1e-4 * expected.abs().max(1.0),
                    "{network:?}: {got}, {expected}"
                );
            }
        }
    }
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let learned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let of_all = all().into_iter().map(|network| {
                let parameters = parameters(&network);
                lesson(&network, &parameters, &shown(&network, 37)).1
            });
            of_all.collect::<Vec<Lesson>>()
        })
    };
    assert!(learned(1) == learned(5));
}

/// `LibTorch` sums in a different order, so that the results are close but not equal.
#[cfg(feature = "libtorch")]
#[test]
fn both_backends_give_the_same_values_and_gradients() {
    let torch = Computer {
        backend: Backend::LibTorch,
        ..COMPUTER
    };
    let near = |network: &One, a: &[f32], b: &[f32]| {
        assert_eq!(a.len(), b.len(), "{network:?}");
        for (a, b) in a.iter().zip(b) {
            assert!(
                (a - b).abs() < 1e-4 * a.abs().max(1.0),
                "{network:?}: {a}, {b}"
            );
        }
    };
    for network in all() {
        let shown = shown(&network, 3);
        let parameters = parameters(&network);
        let found = [COMPUTER, torch].map(|computer| computer.find(&network, &parameters, &shown));
        for (a, b) in found[0].iter().zip(&found[1]) {
            near(&network, a, b);
        }
        let lessons = [COMPUTER, torch]
            .map(|computer| lesson_by(computer, &network, (&parameters, &shown)).1);
        for (a, b) in lessons[0].gradients.iter().zip(&lessons[1].gradients) {
            let [a, b] = [a, b].map(|gradient| gradient.clone().unwrap_or_default());
            near(&network, &a, &b);
        }
        for (a, b) in lessons[0].statistics.iter().zip(&lessons[1].statistics) {
            assert_eq!(a.at, b.at, "{network:?}");
            near(&network, &a.mean, &b.mean);
            near(&network, &a.variance, &b.variance);
        }
    }
}
