//! Compares convolutions with plain loops and with their definition.

use proptest::prelude::*;

use super::*;
use crate::sized;

/// Pseudo-random numbers, some of them zero.
fn noise(n: usize, seed: u64) -> Vec<f32> {
    let mut state = seed.wrapping_mul(6364136223846793005) | 1;
    let next = |_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
        let value = (state >> 40) as f32 / (1 << 23) as f32 - 1.0;
        if state >> 60 == 0 { 0.0 } else { value }
    };
    (0..n).map(next).collect()
}

fn stack(shape: BlockedShape, seed: u64) -> Blocked {
    let mut stack = Blocked::new(shape);
    stack.fill(&noise(shape.sides().iter().product(), seed));
    stack
}

fn bits(stack: &Blocked) -> Vec<u32> {
    stack.values().iter().map(|value| value.to_bits()).collect()
}

/// A random valid layer.
#[derive(Debug, Clone)]
struct Case {
    size: ConvSize,
    sides: [usize; 2],
    border: usize,
    is_packed: bool,
    in_tiles: bool,
    has_residual: bool,
    gives: [bool; 2],
    seed: u64,
}

fn cases() -> impl Strategy<Value = Case> {
    let side = sized(19, 4);
    let channels = 1..sized(70, 20);
    let kernel = ([1..4_usize, 1..4_usize], [1..4_usize, 1..4_usize]);
    let stacks = ([1..=side, 1..=side], 0..3_usize);
    let flags = (0..4_u8, any::<bool>(), 0..3_usize, any::<u64>());
    ([channels.clone(), channels], kernel, stacks, flags).prop_map(
        |([inputs, outputs], (kernel, stride), (sides, border), flags)| {
            let (form, has_residual, gives, seed) = flags;
            let in_tiles = form > 1;
            let (kernel, stride) = if in_tiles {
                ([3; 2], [1; 2])
            } else {
                (kernel, stride)
            };
            let size = ConvSize {
                inputs,
                outputs,
                kernel,
                stride,
                pad: kernel.map(|side| (side - 1).min(border)),
            };
            Case {
                size,
                sides: [0, 1].map(|axis| sides[axis].max(kernel[axis])),
                border,
                is_packed: form == 1,
                in_tiles,
                has_residual,
                gives: [gives != 0, gives != 1],
                seed,
            }
        },
    )
}

impl Case {
    /// Rows and columns of the output if the padding after the input equals the padding before it.
    fn out(&self) -> [usize; 2] {
        [0, 1].map(|axis| {
            let padded = self.sides[axis] + 2 * self.size.pad[axis];
            (padded - self.size.kernel[axis]) / self.size.stride[axis] + 1
        })
    }

    fn conv(&self) -> Conv {
        let size = self.size;
        let n = size.outputs * size.inputs * size.kernel.iter().product::<usize>();
        let (weights, bias) = (noise(n, self.seed ^ 1), noise(size.outputs, self.seed ^ 2));
        if self.in_tiles {
            Conv::in_tiles(size, &weights, &bias).unwrap().unwrap()
        } else {
            Conv::new(size, &weights, &bias, self.is_packed).unwrap()
        }
    }

    fn input(&self) -> Blocked {
        let sides = [self.size.inputs, self.sides[0], self.sides[1]];
        let shape = if self.is_packed {
            BlockedShape::packed(sides, self.border)
        } else {
            BlockedShape::new(sides, self.border)
        };
        stack(shape, self.seed)
    }

    /// The bits of both outputs.
    fn given(&self, run: impl FnOnce(&Conv, &Blocked, Option<&Blocked>, Outputs<'_>)) -> Vec<u32> {
        let [rows, cols] = self.out();
        let shape = BlockedShape::new([self.size.outputs, rows, cols], 1);
        let residual = self.has_residual.then(|| stack(shape, self.seed ^ 3));
        let [mut raw, mut relu] = [0, 1].map(|_| Blocked::new(shape));
        let outputs = Outputs {
            raw: self.gives[0].then_some(&mut raw),
            relu: self.gives[1].then_some(&mut relu),
        };
        run(&self.conv(), &self.input(), residual.as_ref(), outputs);
        [bits(&raw), bits(&relu)].concat()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(sized(96, 2) as u32))]

    #[test]
    fn convolution_equals_the_plain_loops_bit_for_bit(case in cases()) {
        let want = case.given(|conv, input, residual, outputs| {
            conv.run_plain(input, residual, outputs);
        });
        for isa in Isa::available() {
            let got = case.given(|conv, input, residual, outputs| {
                conv.run(isa, (input, residual), outputs, &mut Scratch::default());
            });
            prop_assert_eq!(&got, &want, "{:?}", isa);
        }
    }

    #[test]
    fn the_plain_loops_equal_the_definition(case in cases()) {
        let (size, [rows, cols]) = (case.size, case.out());
        let (conv, input) = (case.conv(), case.input());
        let mut raw = Blocked::new(BlockedShape::new([size.outputs, rows, cols], 0));
        conv.run_plain(&input, None, Outputs { raw: Some(&mut raw), relu: None });
        let [down, across] = size.kernel;
        let weights = noise(size.outputs * size.inputs * down * across, case.seed ^ 1);
        let bias = noise(size.outputs, case.seed ^ 2);
        for (output, row, col) in [(0, 0, 0), (size.outputs - 1, rows - 1, cols - 1)] {
            let mut sum = f64::from(bias[output]);
            for (at, weight) in weights.chunks(size.inputs * down * across).nth(output).unwrap().iter().enumerate() {
                let (channel, y, x) = (at / across / down, at / across % down, at % across);
                let y = (row * size.stride[0] + y).checked_sub(size.pad[0]);
                let x = (col * size.stride[1] + x).checked_sub(size.pad[1]);
                sum += f64::from(*weight) * f64::from(input.get(channel, [y, x]));
            }
            let got = raw.get(output, [Some(row), Some(col)]);
            prop_assert!((f64::from(got) - sum).abs() < 1e-4, "{} {}", got, sum);
        }
    }

    #[test]
    fn each_pixel_of_a_coarser_stack_is_added_to_all_pixels_that_it_covers(
        channels in 1..40_usize, rows in 1..6_usize, cols in 1..6_usize, repeat in 1..4_usize,
    ) {
        let fine = BlockedShape::new([channels, rows * repeat, cols * repeat], 1);
        let [a, b] = [(fine, 1), (BlockedShape::new([channels, rows, cols], 2), 2)]
            .map(|(shape, seed)| stack(shape, seed));
        for isa in Isa::available() {
            let [mut raw, mut relu] = [0, 1].map(|_| Blocked::new(fine));
            add_repeated(isa, &a, &b, repeat, Outputs { raw: Some(&mut raw), relu: Some(&mut relu) });
            for (channel, row, col) in [(0, 0, 0), (channels - 1, rows * repeat - 1, cols * repeat - 1)] {
                let at = [Some(row), Some(col)];
                let want = a.get(channel, at) + b.get(channel, [Some(row / repeat), Some(col / repeat)]);
                prop_assert_eq!(raw.get(channel, at), want);
                prop_assert_eq!(relu.get(channel, at), want.max(0.0));
            }
        }
    }

    #[test]
    fn planes_survive_a_round_trip_through_blocks(channels in 1..40_usize, rows in 1..5_usize, cols in 1..5_usize) {
        let planes = noise(channels * rows * cols, 7);
        for shape in [BlockedShape::new, BlockedShape::packed].map(|new| new([channels, rows, cols], 1)) {
            let mut stack = Blocked::new(shape);
            stack.fill(&planes);
            let mut got = Vec::new();
            stack.write(&mut got);
            prop_assert_eq!(&got, &planes);
        }
    }
}

#[test]
fn nan_stays_nan() {
    let size = ConvSize {
        inputs: 1,
        outputs: 1,
        kernel: [1; 2],
        stride: [1; 2],
        pad: [0; 2],
    };
    let conv = Conv::new(size, &[1.0], &[0.0], false).unwrap();
    let shape = BlockedShape::new([1, 1, 1], 0);
    let [mut input, mut relu] = [0, 1].map(|_| Blocked::new(shape));
    input.fill(&[f32::NAN]);
    for isa in Isa::available() {
        let outputs = Outputs {
            raw: None,
            relu: Some(&mut relu),
        };
        conv.run(isa, (&input, None), outputs, &mut Scratch::default());
        assert!(relu.get(0, [Some(0); 2]).is_nan(), "{isa:?}");
    }
}

#[test]
fn only_three_by_three_kernels_with_stride_one_are_computed_in_tiles() {
    for (kernel, stride) in [([3, 3], [2, 2]), ([3, 1], [1, 1]), ([1, 1], [1, 1])] {
        let size = ConvSize {
            inputs: 1,
            outputs: 1,
            kernel,
            stride,
            pad: [0; 2],
        };
        assert!(Conv::in_tiles(size, &[1.0; 9], &[0.0]).unwrap().is_none());
    }
}

#[test]
fn weights_that_do_not_fit_are_refused_with_their_numbers() {
    let size = ConvSize {
        inputs: 2,
        outputs: 3,
        kernel: [3; 2],
        stride: [1; 2],
        pad: [1; 2],
    };
    let error = Conv::new(size, &[0.0; 53], &[0.0; 3], false).unwrap_err();
    assert_eq!(
        error.to_string(),
        "a convolution from 2 to 3 channels with kernel [3, 3] has 53 weights and 3 biases"
    );
}
