//! The residual network over a picture, used by the networks for joints and for people.
//!
//! The convolutions are not followed by batch normalisation. Their weights are standardised instead (Brock et al. 2021, "Characterizing
//! signal propagation to close the performance gap in unnormalized `ResNets`"). At the start of a training run, every residual block is the
//! identity.

use crate::networks::ops::{Conv, Ops, Scaling};

/// The sizes of a trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trunk {
    /// Number of channels of the first layer.
    pub(crate) stem: usize,
    /// Numbers of channels at strides 4, 8, 16 and 32.
    pub(crate) channels: [usize; 4],
    /// Numbers of residual blocks at strides 4, 8, 16 and 32.
    pub(crate) blocks: [usize; 4],
    /// Number of residual blocks at stride 4, applied after the features of all strides have been added.
    pub(crate) refined: usize,
    /// Number of channels inside the residual blocks counted by `refined`.
    pub(crate) hidden: usize,
}

impl Trunk {
    /// Returns the features at stride 4 and the deepest features, which are positive.
    pub(crate) fn run<O: Ops>(&self, ops: &mut O, picture: &O::Value) -> [O::Value; 2] {
        let stem = ops.conv(picture, "stem1", plain(self.stem, 3, 2));
        let stem = ops.relu(&stem);
        let mut at = ops.conv(&stem, "stem2", plain(self.channels[0], 3, 2));
        let mut levels = Vec::new();
        for (level, (&channels, &blocks)) in self.channels.iter().zip(&self.blocks).enumerate() {
            if level > 0 {
                let active = ops.relu(&at);
                at = ops.conv(&active, &format!("down{level}"), plain(channels, 3, 2));
            }
            for nth in 0..blocks {
                let name = format!("level{level}.{nth}");
                at = block(ops, &at, &name, [channels, channels / 2]);
            }
            levels.push(at.clone());
        }
        let deepest = ops.relu(&at);
        for level in (0..self.channels.len() - 1).rev() {
            let channels = self.channels[level];
            let active = ops.relu(&at);
            let narrowed = ops.conv(&active, &format!("up{level}"), plain(channels, 1, 1));
            let enlarged = ops.doubled(&narrowed);
            at = ops.add(&levels[level], &enlarged);
            let (n, hidden) = match level {
                0 => (self.refined, self.hidden),
                _ => (1, channels / 2),
            };
            for nth in 0..n {
                let name = format!("refine{level}.{nth}");
                at = block(ops, &at, &name, [channels, hidden]);
            }
        }
        [at, deepest]
    }
}

/// A convolution with standardised weights.
pub(crate) fn plain(channels: usize, kernel: usize, stride: usize) -> Conv {
    Conv {
        channels,
        kernel,
        stride,
        by_channel: false,
        scaling: Scaling::Standardised { gain: 1.0 },
    }
}

/// The same convolution with a different initial gain.
pub(crate) fn with_gain(gain: f32, conv: Conv) -> Conv {
    Conv {
        scaling: Scaling::Standardised { gain },
        ..conv
    }
}

/// A residual block: reduces the channels, convolves, restores the channels, and adds the input.
pub(crate) fn block<O: Ops>(
    ops: &mut O,
    at: &O::Value,
    name: &str,
    [channels, hidden]: [usize; 2],
) -> O::Value {
    let x = ops.relu(at);
    let x = ops.conv(&x, &format!("{name}.narrow"), plain(hidden, 1, 1));
    let x = ops.relu(&x);
    let x = ops.conv(&x, &format!("{name}.inner"), plain(hidden, 3, 1));
    let x = ops.relu(&x);
    let widen = with_gain(0.0, plain(channels, 1, 1));
    let x = ops.conv(&x, &format!("{name}.widen"), widen);
    ops.add(at, &x)
}
