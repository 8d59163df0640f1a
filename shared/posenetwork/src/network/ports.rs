//! The names of a network's input and outputs, checked against its card.

use inference::{Port, written};
use keypoints::{Card, Codec, Layout};

use super::FitError;

fn listed(ports: &[Port]) -> String {
    let names: Vec<String> = ports
        .iter()
        .map(|port| format!("`{}` {}", port.name, written(&port.sides)))
        .collect();
    names.join(", ")
}

/// The name of the input, checked against the card.
pub(crate) fn input_of(input_card: &keypoints::Input, inputs: &[Port]) -> Result<String, FitError> {
    let input = match (&input_card.name, inputs) {
        (Some(name), _) => {
            inputs.iter().find(|input| input.name == *name).ok_or_else(|| FitError::Name {
                what: "input",
                wanted: name.clone(),
                has: listed(inputs),
            })?
        }
        (None, [input]) => input,
        (None, _) => {
            return Err(FitError::Several {
                what: "input",
                has: listed(inputs),
                key: "input.name",
            });
        }
    };
    let keypoints::Input {
        width,
        height,
        layout,
        ..
    } = input_card;
    let expected = match layout {
        Layout::Planes => [1, 3, *height, *width],
        Layout::Pixels => [1, *height, *width, 3],
    };
    let sides = &input.sides;
    let fits = sides.len() == 4 && sides.iter().zip(expected).all(|(side, n)| side.may_be(n));
    if !sides.is_empty() && !fits {
        return Err(FitError::InputShape {
            name: input.name.clone(),
            got: written(sides),
            expected: format!("{expected:?}"),
        });
    }
    Ok(input.name.clone())
}

/// The names of the outputs that the codec reads, and of the additional outputs.
pub(super) fn outputs_of(card: &Card, outputs: &[Port]) -> Result<Vec<String>, FitError> {
    let mut names = outputs_of_codec(card, outputs)?;
    let also = [
        (&card.also.front, "also.front"),
        (&card.also.error, "also.error"),
    ];
    for (name, key) in also {
        if name.is_some() {
            names.push(only(name.as_ref(), outputs, key)?);
        }
    }
    Ok(names)
}

fn outputs_of_codec(card: &Card, outputs: &[Port]) -> Result<Vec<String>, FitError> {
    match &card.output {
        Codec::HeatMap { maps, .. } => Ok(vec![only(maps.as_ref(), outputs, "output.maps")?]),
        Codec::Simcc { x, y, .. } => Ok(vec![
            only(Some(x), outputs, "output.x")?,
            only(Some(y), outputs, "output.y")?,
        ]),
        Codec::Keypoints { list, .. } => Ok(vec![only(list.as_ref(), outputs, "output.list")?]),
    }
}

/// The output with a given name, or the only output.
pub(crate) fn only(
    name: Option<&String>,
    outputs: &[Port],
    key: &'static str,
) -> Result<String, FitError> {
    match (name, outputs) {
        (Some(name), _) if outputs.iter().any(|output| output.name == *name) => Ok(name.clone()),
        (Some(name), _) => Err(FitError::Name {
            what: "output",
            wanted: name.clone(),
            has: listed(outputs),
        }),
        (None, [output]) => Ok(output.name.clone()),
        (None, _) => Err(FitError::Several {
            what: "output",
            has: listed(outputs),
            key,
        }),
    }
}
