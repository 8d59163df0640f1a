//! Which of the cards that ship a network comes nearest to.

use inference::{Description, Port};
use keypoints::{Card, Codec, Layout, SHIPPED};

/// The cards of `configs/networks` that agree best with what a network takes and gives, by sides and names; several where
/// they agree equally well, none where nothing agrees.
pub fn nearest(description: &Description) -> Vec<&'static str> {
    let rated = SHIPPED.iter().filter_map(|(name, text)| {
        let card = Card::parse(text).ok()?;
        let points = points(&card, description)?;
        Some((*name, points))
    });
    let rated: Vec<_> = rated.collect();
    let best = rated.iter().map(|it| it.1).max();
    let best = rated.iter().filter(|it| Some(it.1) == best);
    best.map(|it| it.0).collect()
}

/// How well a card agrees; `None` if neither an input nor an output does.
fn points(card: &Card, description: &Description) -> Option<usize> {
    let [width, height] = [card.input.width, card.input.height];
    let sides = match card.input.layout {
        Layout::Planes => [1, 3, height, width],
        Layout::Pixels => [1, height, width, 3],
    };
    let input = description.inputs.iter().map(|it| agreeing(it, &sides));
    let input = input.flatten().max();
    let outputs = || description.outputs.iter();
    let n = card.names().len();
    let named = |name: &str| usize::from(outputs().any(|it| it.name == name));
    let given = |sides: &[usize]| outputs().filter_map(|it| agreeing(it, sides)).max();
    let (output, names) = match &card.output {
        Codec::HeatMap {
            maps,
            further,
            layout,
            ..
        } => {
            let channels = n + further;
            let maps_are = |it: &Port| {
                let channel = match layout {
                    Layout::Planes => 1,
                    Layout::Pixels => 3,
                };
                it.sides.len() == 4 && it.sides[channel].may_be(channels)
            };
            let output = outputs().any(maps_are).then_some(3);
            (output, maps.as_deref().map_or(0, named))
        }
        Codec::Simcc {
            x,
            y,
            bins_per_pixel,
            ..
        } => {
            let bins = |side: usize| (side as f64 * bins_per_pixel).round() as usize;
            let across = given(&[1, n, bins(width)]);
            let output = across.and_then(|it| Some(it.min(given(&[1, n, bins(height)])?)));
            (output, named(x) + named(y))
        }
        Codec::Keypoints { list, fields, .. } => {
            let flat = given(&[1, n * fields.len()]);
            let rows = given(&[1, n, fields.len()]);
            let nested = given(&[1, 1, n, fields.len()]);
            let output = flat.max(rows).max(nested);
            (output, list.as_deref().map_or(0, named))
        }
    };
    let named_input = card.input.name.as_ref().is_some_and(|name| {
        let mut inputs = description.inputs.iter();
        inputs.any(|it| it.name == *name)
    });
    let points = input.unwrap_or(0) + 2 * output.unwrap_or(0);
    (points > 0).then_some(points + names + usize::from(named_input))
}

/// How many sides are these, if all of them can be.
fn agreeing(port: &Port, sides: &[usize]) -> Option<usize> {
    let fits = port.sides.len() == sides.len()
        && port
            .sides
            .iter()
            .zip(sides)
            .all(|(side, n)| side.may_be(*n));
    let fixed = |it: &&inference::Side| matches!(it, inference::Side::Fixed(_));
    fits.then(|| port.sides.iter().filter(fixed).count())
}
