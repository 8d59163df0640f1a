//! Search for the shipped cards that are most similar to a network.

use inference::{Description, Port, Side};
use keypoints::{Boxes, Card, Codec, DetectorCard, Input, Layout, SHIPPED, SHIPPED_DETECTORS};

/// Returns the cards in `configs/networks` that agree best with the inputs and outputs of a network, according to sizes and names. Returns
/// several cards if they agree equally well, and no card if none agrees.
pub fn nearest(description: &Description) -> Vec<&'static str> {
    let rated = SHIPPED.iter().filter_map(|(name, text)| {
        let card = Card::parse(text).ok()?;
        let points = points(&card, description)?;
        Some((*name, points))
    });
    best(&rated.collect::<Vec<_>>())
}

/// Works like [`nearest`], but for the cards in `configs/detectors` whose input and output can match the network.
pub fn nearest_detectors(description: &Description) -> Vec<&'static str> {
    let rated = SHIPPED_DETECTORS.iter().filter_map(|(name, text)| {
        let card = DetectorCard::parse(text).ok()?;
        let points = points_of_detector(&card, description)?;
        Some((*name, points))
    });
    best(&rated.collect::<Vec<_>>())
}

fn best(rated: &[(&'static str, usize)]) -> Vec<&'static str> {
    let best = rated.iter().map(|rated| rated.1).max();
    let best = rated.iter().filter(|rated| Some(rated.1) == best);
    best.map(|rated| rated.0).collect()
}

/// Returns a score for the agreement of a detector's card; `None` if the output does not agree.
fn points_of_detector(card: &DetectorCard, description: &Description) -> Option<usize> {
    let input = of_input(&card.input, description);
    let outputs = description.outputs.iter();
    let output = match &card.output {
        // The cells are counted for the network's own input, which may be larger than the input on the card.
        Boxes::Yolox {
            person, strides, ..
        } => {
            let cells = description.inputs.iter().find_map(|input| cells(input, strides));
            let many = |port: &Port| match &port.sides[..] {
                [one, n_cells, Side::Fixed(n)] => {
                    one.may_be(1)
                        && cells.is_some_and(|cell| n_cells.may_be(cell))
                        && *n > 5 + person
                }
                _ => false,
            };
            outputs.filter(|output| many(output)).map(|_| 2).max()
        }
        // Detectors of this kind contain their card in the ONNX file.
        Boxes::Centres { .. } => None,
        Boxes::List { boxes } => {
            let five = |port: &Port| match &port.sides[..] {
                [one, _, five] => one.may_be(1) && five.may_be(5),
                _ => false,
            };
            let rated = outputs.filter(|output| five(output));
            rated.map(|rated| 2 + usize::from(rated.name == *boxes)).max()
        }
    };
    Some(input.unwrap_or(0) + 2 * output?)
}

/// Returns the number of cells in grids of these strides over an input.
fn cells(input: &Port, strides: &[usize]) -> Option<usize> {
    let &[_, _, Side::Fixed(height), Side::Fixed(width)] = &input.sides[..] else {
        return None;
    };
    Some(strides.iter().map(|stride| (width / stride) * (height / stride)).sum())
}

/// Returns the number of sides of the input that agree with a card.
fn of_input(card: &Input, description: &Description) -> Option<usize> {
    let [width, height] = [card.width, card.height];
    let sides = match card.layout {
        Layout::Planes => [1, 3, height, width],
        Layout::Pixels => [1, height, width, 3],
    };
    let inputs = description.inputs.iter();
    inputs.filter_map(|input| agreeing(input, &sides)).max()
}

/// Returns a score for the agreement of a card; `None` if no output is of the kind that the card describes. The kind of output has the most
/// weight, then the number of keypoints, then the order of axes, then sides and names.
fn points(card: &Card, description: &Description) -> Option<usize> {
    let [width, height] = [card.input.width, card.input.height];
    let outputs = || description.outputs.iter();
    let n = card.names().len();
    let named = |name: &str| usize::from(outputs().any(|output| output.name == name));
    let given = |sides: &[usize]| outputs().filter_map(|output| agreeing(output, sides)).max();
    let (output, names) = match &card.output {
        Codec::HeatMap {
            maps,
            further,
            layout,
            ..
        } => {
            let rated = outputs().filter_map(|output| of_maps(output, n, *further, *layout));
            (rated.max(), maps.as_deref().map_or(0, named))
        }
        Codec::Simcc {
            x,
            y,
            bins_per_pixel,
            ..
        } => {
            let bins = |side: usize| (side as f64 * bins_per_pixel).round() as usize;
            let across = given(&[1, n, bins(width)]);
            let output = across.and_then(|across| Some(across.min(given(&[1, n, bins(height)])?)));
            (output.map(|output| 8 + output), named(x) + named(y))
        }
        Codec::Keypoints { list, fields, .. } => {
            let flat = given(&[1, n * fields.len()]);
            let rows = given(&[1, n, fields.len()]);
            let nested = given(&[1, 1, n, fields.len()]);
            let output = flat.max(rows).max(nested);
            (
                output.map(|output| 8 + output),
                list.as_deref().map_or(0, named),
            )
        }
    };
    let named_input = card.input.name.as_ref().is_some_and(|name| {
        let mut inputs = description.inputs.iter();
        inputs.any(|input| input.name == *name)
    });
    let input = of_input(&card.input, description).unwrap_or(0);
    Some(2 * output? + input + names + usize::from(named_input))
}

/// Returns a score for the agreement of an output with maps of keypoints; `None` if it has no maps.
fn of_maps(output: &Port, n: usize, further: usize, layout: Layout) -> Option<usize> {
    /// Minimum number of rows and columns of maps.
    const LEAST_SIDE: usize = 8;
    let [_, second, third, fourth] = &output.sides[..] else {
        return None;
    };
    let is_maps = |channels: &Side, sides: [&Side; 2]| {
        let is_side = |side: &Side| !matches!(side, Side::Fixed(n) if *n < LEAST_SIDE);
        let is_fewer = match (channels, sides) {
            (Side::Fixed(n), [Side::Fixed(a), Side::Fixed(b)]) => n <= a || n <= b,
            _ => true,
        };
        is_fewer && sides.into_iter().all(is_side)
    };
    let found = [
        (Layout::Planes, second, [third, fourth]),
        (Layout::Pixels, fourth, [second, third]),
    ];
    let rated = found.into_iter().filter(|(_, channels, sides)| is_maps(channels, *sides));
    let rated = rated.map(|(order, channels, _)| {
        let known = if channels.may_be(n + further) {
            4
        } else if channels.may_be(n) {
            3
        } else {
            0
        };
        4 + known + usize::from(order == layout)
    });
    rated.max()
}

/// Returns the number of sides that have exactly the given sizes; `None` if a side has a different size.
fn agreeing(port: &Port, sides: &[usize]) -> Option<usize> {
    let fits = port.sides.len() == sides.len()
        && port.sides.iter().zip(sides).all(|(side, n)| side.may_be(*n));
    let fixed = |side: &&Side| matches!(side, Side::Fixed(_));
    fits.then(|| port.sides.iter().filter(fixed).count())
}
