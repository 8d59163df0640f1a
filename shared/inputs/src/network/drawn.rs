//! Drawings of the output of a network.

use footage::{Canvas, Limb, Side, Size, Tile, compose, draw_limbs};
use keypoints::Keypoint;
use posenetwork::{JointMaps, LookError, MapSettings, Sight};
use skeleton::PARSE14;

use crate::pictures::Picture;

/// Number of tiles in a row.
const N_COLUMNS: usize = 5;
/// Height of a tile, in pixels.
const HEIGHT: usize = 256;
/// Colour of a map at value 1.
const HOT: [f64; 3] = [255.0, 40.0, 40.0];

/// Returns the lines between the joints of `skeleton::PARSE14`.
pub fn limbs() -> Vec<Limb> {
    let side = |joint: usize| match PARSE14.joints[joint].name {
        name if name.starts_with("left") => Side::Left,
        name if name.starts_with("right") => Side::Right,
        _ => Side::Centre,
    };
    let limb = |&(from, to): &(usize, usize)| Limb {
        from,
        to,
        side: match side(from) {
            Side::Centre => side(to),
            known => known,
        },
    };
    PARSE14.limbs.iter().map(limb).collect()
}

/// Draws the output of a network for its window of a picture. The first tile shows the joints. Each further tile shows the map of one joint
/// over the window, with the joint's name and its score from 0 to 1. Maps are drawn relative to their highest value, so that weak ones are
/// visible.
///
/// # Errors
///
/// Fails with [`LookError::Output`]; this cannot happen after the network has run.
pub fn sheet(picture: &Picture, sight: &Sight<'_>) -> Result<Canvas, LookError> {
    let settings = MapSettings::default();
    let mut maps = JointMaps::default();
    maps.read(sight, &settings)?;
    let network = sight.network();
    let [width, height] = network.size();
    let size = Size::new((HEIGHT * width / height).clamp(1, 4 * HEIGHT), HEIGHT);
    let per_tile = [
        width as f64 / size.width as f64,
        height as f64 / size.height as f64,
    ];
    let window = *sight.window();
    let place = |pixel: usize| {
        let at = [pixel % size.width, pixel / size.width];
        let at = [0, 1].map(|axis| (at[axis] as f64 + 0.5) * per_tile[axis] - 0.5);
        window.in_picture(at)
    };
    let places: Vec<[f64; 2]> = (0..size.width * size.height).map(place).collect();
    let plain: Vec<[u8; 3]> = places.iter().map(|place| colour(picture, *place)).collect();
    let in_tile = |point: [f64; 2]| {
        let at = window.in_input(point);
        [0, 1].map(|axis| (at[axis] + 0.5) / per_tile[axis] - 0.5)
    };
    let mut joints = Canvas::from_rgb(size, plain.as_flattened());
    let peaks = maps.peaks();
    let points: Vec<[f64; 2]> = peaks
        .iter()
        .map(|peak| peak.map_or([f64::NAN; 2], |peak| in_tile(peak.at)))
        .collect();
    draw_limbs(&mut joints, &points, &limbs());
    let mut tiles = vec![(joints, network.card().name.clone())];
    for (joint, (named, peak)) in PARSE14.joints.iter().zip(peaks).enumerate() {
        let Some(peak) = peak else {
            continue;
        };
        let heat = places.iter().map(|place| settings.heat(maps.at(joint, *place)));
        let heat: Vec<f64> = heat.collect();
        let mut tile = Canvas::from_rgb(size, heated(&plain, &heat).as_flattened());
        tile.ring(in_tile(peak.at), 5.0, 1.5, footage::CENTRE);
        tiles.push((tile, caption(named.name, peak)));
    }
    let tiles: Vec<Tile<'_>> =
        tiles.iter().map(|(picture, caption)| Tile { picture, caption }).collect();
    Ok(compose(&tiles, N_COLUMNS))
}

fn caption(name: &str, peak: &Keypoint) -> String {
    format!("{name} {:.2}", peak.score)
}

/// Returns the picture with a map over it.
fn heated(plain: &[[u8; 3]], heat: &[f64]) -> Vec<[u8; 3]> {
    let most = heat.iter().copied().fold(1e-3, f64::max);
    let mixed = |(colour, heat): (&[u8; 3], &f64)| {
        let share = 0.8 * (heat / most).clamp(0.0, 1.0);
        let grey = colour.iter().map(|colour| f64::from(*colour)).sum::<f64>() / 3.0;
        HOT.map(|hot| (0.7 * grey * (1.0 - share) + hot * share).round() as u8)
    };
    plain.iter().zip(heat).map(mixed).collect()
}

/// Returns the pixel at a point; black outside the picture.
fn colour(picture: &Picture, [x, y]: [f64; 2]) -> [u8; 3] {
    let (x, y) = (x.round(), y.round());
    let size = picture.size;
    if x < 0.0 || y < 0.0 || x >= size.width as f64 || y >= size.height as f64 {
        return [0; 3];
    }
    let pixel = y as usize * size.width + x as usize;
    core::array::from_fn(|channel| picture.rgb[3 * pixel + channel])
}
