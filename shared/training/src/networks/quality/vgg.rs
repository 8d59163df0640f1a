//! Reads the weights of torchvision's VGG-16 from a `.safetensors` file.
//!
//! The file has eight bytes with the length of a header, the header as JSON (`{"features.0.weight": {"dtype": "F32", "shape": [64, 3, 3,
//! 3], "data_offsets": [0, 6912]}, ...}`), and the values, little-endian. The top (`classifier`) is not read, because the network here has
//! a different top.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::network::VGG16;
use crate::networks::parameters::{Parameter, Role};

/// Reason why bytes are not the weights of VGG-16.
#[derive(Debug, thiserror::Error)]
pub enum VggError {
    /// The bytes end before the data that the header describes.
    #[error("it is truncated, or not a .safetensors file")]
    Truncated,
    /// The header is invalid.
    #[error("its header cannot be read")]
    Header(#[from] serde_json::Error),
    /// A layer is missing.
    #[error("the file has no `{name}`")]
    Missing {
        /// Name of the layer.
        name: String,
    },
    /// A layer has a different size or number type.
    #[error("`{name}` is {dtype} of {got:?}, expected F32 of {expected:?}")]
    Layer {
        /// Name of the layer.
        name: String,
        /// Number type in the file.
        dtype: String,
        /// Dimensions in the file.
        got: Vec<usize>,
        /// Expected dimensions.
        expected: Vec<usize>,
    },
}

#[derive(Debug, Deserialize)]
struct Entry {
    dtype: String,
    shape: Vec<usize>,
    data_offsets: [usize; 2],
}

/// Reads the thirteen convolutions of a file.
///
/// # Errors
///
/// Fails if the bytes are not a file of this kind, or belong to a different network.
pub fn parse(bytes: &[u8]) -> Result<Vec<Parameter>, VggError> {
    let (length, rest) = bytes.split_first_chunk().ok_or(VggError::Truncated)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok();
    let split = length.and_then(|length| rest.split_at_checked(length));
    let (header, data) = split.ok_or(VggError::Truncated)?;
    let mut header: BTreeMap<String, serde_json::Value> = serde_json::from_slice(header)?;
    let mut all = Vec::new();
    let (mut at, mut inputs) = (0, 3);
    for (block, layers) in VGG16.iter().enumerate() {
        for (nth, &channels) in layers.iter().enumerate() {
            let name = format!("conv{}_{}", block + 1, nth + 1);
            let sizes = [vec![channels, inputs, 3, 3], vec![channels]];
            for (what, dims, role) in [
                ("weight", &sizes[0], Role::Weight),
                ("bias", &sizes[1], Role::Bias),
            ] {
                let theirs = format!("features.{at}.{what}");
                let entry = header.remove(&theirs);
                let entry = entry.ok_or_else(|| VggError::Missing {
                    name: theirs.clone(),
                })?;
                all.push(Parameter {
                    name: format!("{name}.{what}"),
                    dims: dims.clone(),
                    role,
                    values: numbers(data, serde_json::from_value(entry)?, &theirs, dims)?,
                });
            }
            inputs = channels;
            // A ReLU follows every convolution, and a pooling follows every block.
            at += 2;
        }
        at += 1;
    }
    Ok(all)
}

fn numbers(data: &[u8], entry: Entry, name: &str, dims: &[usize]) -> Result<Vec<f32>, VggError> {
    let n: usize = dims.iter().product();
    let [from, to] = entry.data_offsets;
    let of = data.get(from..to).ok_or(VggError::Truncated)?;
    if entry.dtype != "F32" || entry.shape != dims || of.len() != 4 * n {
        return Err(VggError::Layer {
            name: name.to_owned(),
            dtype: entry.dtype,
            got: entry.shape,
            expected: dims.to_vec(),
        });
    }
    let words = of.as_chunks::<4>().0;
    Ok(words.iter().map(|word| f32::from_le_bytes(*word)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with generated weights: every value of a layer is the layer's number.
    fn file(change: impl Fn(&mut String)) -> Vec<u8> {
        let numbers = [0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28];
        let channels: Vec<usize> = VGG16.concat();
        let (mut header, mut data, mut inputs) =
            (String::from("{\"__metadata__\": {}"), Vec::new(), 3);
        for (number, channels) in numbers.into_iter().zip(channels) {
            for (what, dims) in [
                ("weight", vec![channels, inputs, 3, 3]),
                ("bias", vec![channels]),
            ] {
                let n: usize = dims.iter().product();
                let from = data.len();
                data.extend((0..n).flat_map(|_| (number as f32).to_le_bytes()));
                let entry = format!(
                    ", \"features.{number}.{what}\": {{\"dtype\": \"F32\", \"shape\": {dims:?}, \"data_offsets\": [{from}, {}]}}",
                    data.len()
                );
                header.push_str(&entry);
            }
            inputs = channels;
        }
        header.push('}');
        change(&mut header);
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend(header.bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn every_convolution_layer_gets_its_weights() {
        let read = parse(&file(|_| ())).unwrap();
        assert_eq!(read.len(), 26);
        let of = |name: &str| read.iter().find(|parameter| parameter.name == name).unwrap();
        assert_eq!(of("conv1_1.weight").dims, [64, 3, 3, 3]);
        assert_eq!(of("conv3_2.bias").values, [12.0; 256]);
        assert_eq!(of("conv5_3.weight").values[0], 28.0);
    }

    #[test]
    fn files_that_are_not_vgg_16_are_refused_with_the_layer_name() {
        let said = |change: &dyn Fn(&mut String)| parse(&file(change)).unwrap_err().to_string();
        let renamed =
            said(&|header| *header = header.replace("features.28.bias", "features.30.bias"));
        assert_eq!(renamed, "the file has no `features.28.bias`");
        let half = said(&|header| *header = header.replacen("F32", "F16", 1));
        assert!(half.starts_with("`features.0.weight` is F16"), "{half}");
        assert!(matches!(
            parse(&file(String::clear)),
            Err(VggError::Header(_))
        ));
    }

    #[test]
    fn truncated_bytes_are_refused() {
        let bytes = file(|_| ());
        for n in [0, 7, 8, 100, bytes.len() - 1] {
            assert!(parse(&bytes[..n]).is_err(), "{n}");
        }
    }
}
