//! The parameters of a previously trained network, from which a new training run starts.

use inference::onnx::value_of_half;
use rten_onnx::onnx::{DataType, ModelProto, TensorProto};

use crate::networks::parameters::{GAIN_OF_RELU, Parameter};

/// Reason why a training run cannot start from a network.
#[derive(Debug, thiserror::Error)]
pub enum BeginError {
    /// The file is not an ONNX file.
    #[error("it is not an ONNX file")]
    Read(#[from] rten_onnx::protobuf::ProtobufError),
    /// A layer is missing: the network in the file is smaller or of a different kind.
    #[error(
        "it has no constant {name}; the network in the settings needs one with the dimensions {expected:?}"
    )]
    Missing {
        /// Name of the layer, with the role of its values.
        name: String,
        /// Expected dimensions.
        expected: Vec<usize>,
    },
    /// A layer has unexpected dimensions.
    #[error(
        "its {name} has the dimensions {got:?}, but the network in the settings has {expected:?}"
    )]
    Size {
        /// Name of the layer, with the role of its values.
        name: String,
        /// Dimensions in the file.
        got: Vec<i64>,
        /// Expected dimensions.
        expected: Vec<usize>,
    },
    /// A constant has a value that is not finite, the wrong number of bytes, or an unexpected type.
    #[error("its {name} does not consist of {n} finite numbers of half or single precision")]
    Numbers {
        /// Name of the layer, with the role of its values.
        name: String,
        /// Expected number of values.
        n: usize,
    },
}

/// Reads the parameters of a network that this crate wrote, in the order of the untrained network's parameters.
///
/// The weights in the file are standardised. The length of every channel's weight vector becomes the gain of the channel. The weights are
/// then scaled to the length that they have at the beginning of a training run. The resulting network gives the same output as the file,
/// except for rounding.
///
/// * `all`: the untrained parameters of the network. They are kept for channels that are 0 in the file.
///
/// # Errors
///
/// Fails with [`BeginError`].
pub(crate) fn begun(mut all: Vec<Parameter>, file: &[u8]) -> Result<Vec<Parameter>, BeginError> {
    let graph = ModelProto::parse_buf(file)?.graph.unwrap_or_default();
    let constants = graph.initializer;
    for at in 0..all.len() {
        if is_gain(&all[at]) {
            continue;
        }
        let values = numbers(&constants, &all[at])?;
        let (these, next) = all.split_at_mut(at + 1);
        let own = &mut these[at].values;
        match next.first_mut().filter(|next| is_gain(next)) {
            // The gains of a convolution are stored directly after its weights.
            Some(gains) => split(&values, own, &mut gains.values),
            None => *own = values,
        }
    }
    Ok(all)
}

fn is_gain(parameter: &Parameter) -> bool {
    parameter.name.rsplit_once('.').is_some_and(|name| name.1 == "gain")
}

/// Splits standardised weights into weights and gains.
fn split(standardised: &[f32], weights: &mut [f32], gains: &mut [f32]) {
    let n_inputs = standardised.len() / gains.len();
    let channels = standardised.chunks_exact(n_inputs);
    let begun = weights.chunks_exact_mut(n_inputs);
    for ((channel, weights), gain) in channels.zip(begun).zip(gains) {
        let length = length(channel);
        *gain = length / GAIN_OF_RELU;
        if length > 0.0 {
            let factor = core::f32::consts::SQRT_2 / length;
            for (weight, value) in weights.iter_mut().zip(channel) {
                *weight = value * factor;
            }
        }
    }
}

fn length(of: &[f32]) -> f32 {
    of.iter().map(|value| value * value).sum::<f32>().sqrt()
}

/// The values of a parameter in the file.
fn numbers(constants: &[TensorProto], of: &Parameter) -> Result<Vec<f32>, BeginError> {
    let Parameter { name, dims, .. } = of;
    let half = format!("{name}.half");
    let named = |tensor: &&TensorProto| {
        tensor.name.as_ref().is_some_and(|own| *own == *name || *own == half)
    };
    let constant = constants.iter().find(named).ok_or_else(|| BeginError::Missing {
        name: name.clone(),
        expected: dims.clone(),
    })?;
    let fits = |(got, expected): (&i64, &usize)| usize::try_from(*got) == Ok(*expected);
    if constant.dims.len() != dims.len() || !constant.dims.iter().zip(dims).all(fits) {
        return Err(BeginError::Size {
            name: name.clone(),
            got: constant.dims.clone(),
            expected: dims.clone(),
        });
    }
    let bytes = constant.raw_data.as_ref().map(|bytes| bytes.borrow());
    let bytes = bytes.as_deref().map_or(&[][..], Vec::as_slice);
    let values: Vec<f32> = match constant.data_type {
        Some(DataType::FLOAT16) => {
            let (each, _) = bytes.as_chunks::<2>();
            each.iter().map(|half| value_of_half(u16::from_le_bytes(*half))).collect()
        }
        Some(DataType::FLOAT) => {
            let (each, _) = bytes.as_chunks::<4>();
            each.iter().map(|value| f32::from_le_bytes(*value)).collect()
        }
        _ => Vec::new(),
    };
    let n = of.values.len();
    if values.len() != n || !values.iter().all(|value| value.is_finite()) {
        let name = name.clone();
        return Err(BeginError::Numbers { name, n });
    }
    Ok(values)
}
