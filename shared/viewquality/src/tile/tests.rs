//! Tests that tiles show the right part of the frame, and that resampling is a weighted mean at every scale.

use proptest::prelude::*;

use super::*;

/// A normalisation that leaves colours in the range from 0 to 255.
const PLAIN: Normalisation = Normalisation {
    mean: [0.0; 3],
    deviation: [1.0 / 255.0; 3],
};

/// Rounds colours, to remove the rounding error of the normalisation.
fn colours(values: &[f32]) -> Vec<f32> {
    values.iter().map(|value| (value * 1e4).round() / 1e4).collect()
}

fn sampled(size: [usize; 2], data: &[u8], tile: &Tile) -> Vec<f32> {
    let image = Rgb8View::new(size[0], size[1], data).unwrap();
    let mut out = vec![f32::NAN; tile.shape.n_values()];
    Sampler::default().sample(image, tile, &PLAIN, &mut out);
    out
}

/// An image in which red is the column, green the row, and blue always 7.
fn ramp([width, height]: [usize; 2]) -> Vec<u8> {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x as u8, y as u8, 7]));
    pixels.flatten().collect()
}

#[test]
fn a_tall_box_fills_the_height_and_a_wide_one_the_width() {
    let tall = Tile::around([10.0, 0.0, 19.0, 159.0], TileShape::SMALL).unwrap();
    assert!((tall.height_px() - 176.0).abs() < 1e-9 && (tall.scale - 1.1).abs() < 1e-9);
    assert_eq!(tall.centre, [14.5, 79.5]);
    let wide = Tile::around([0.0, 0.0, 63.0, 9.0], TileShape::SMALL).unwrap();
    assert!((wide.width_px() - 70.4).abs() < 1e-9);
}

#[test]
fn an_empty_or_infinite_box_has_no_tile() {
    for bad in [
        [0.0, 0.0, -1.0, 5.0],
        [0.0, 0.0, 5.0, f64::NAN],
        [0.0, 0.0, f64::INFINITY, 5.0],
    ] {
        assert_eq!(Tile::around(bad, TileShape::SMALL), None);
    }
}

#[test]
fn at_scale_1_on_whole_pixels_a_tile_is_a_crop() {
    let shape = TileShape {
        height: 4,
        width: 2,
    };
    let tile = Tile {
        shape,
        centre: [5.5, 7.5],
        scale: 1.0,
    };
    let out = sampled([20, 20], &ramp([20, 20]), &tile);
    assert_eq!(colours(&out[..8]), [5.0, 6.0, 5.0, 6.0, 5.0, 6.0, 5.0, 6.0]);
    assert_eq!(
        colours(&out[8..16]),
        [6.0, 6.0, 7.0, 7.0, 8.0, 8.0, 9.0, 9.0]
    );
    assert_eq!(colours(&out[16..]), [7.0; 8]);
}

#[test]
fn outside_the_frame_the_border_is_repeated() {
    let shape = TileShape {
        height: 3,
        width: 3,
    };
    let tile = Tile {
        shape,
        centre: [-50.0, 50.0],
        scale: 1.0,
    };
    let out = sampled([8, 8], &ramp([8, 8]), &tile);
    assert_eq!(colours(&out[..9]), [0.0; 9]);
    assert_eq!(colours(&out[9..18]), [7.0; 9]);
}

#[test]
fn stripes_finer_than_the_tile_become_grey() {
    let data: Vec<u8> = (0..64 * 64).flat_map(|i| [255 * (i % 2) as u8; 3]).collect();
    let shape = TileShape {
        height: 4,
        width: 4,
    };
    let tile = Tile {
        shape,
        centre: [31.5, 31.5],
        scale: 8.0,
    };
    for value in sampled([64, 64], &data, &tile) {
        assert!((value - 127.5).abs() < 0.01, "{value}");
    }
}

#[test]
fn positions_are_relative_to_the_centre_in_heights() {
    let tile = Tile {
        shape: TileShape::SMALL,
        centre: [100.0, 50.0],
        scale: 2.0,
    };
    assert_eq!(tile.place([100.0, 50.0]), [0.0, 0.0]);
    assert_eq!(tile.place([180.0, 210.0]), [0.25, 0.5]);
    assert_eq!(tile.rectangle(), [36.5, -109.5, 163.5, 209.5]);
}

#[test]
fn colours_are_normalised() {
    let shape = TileShape {
        height: 1,
        width: 1,
    };
    let tile = Tile {
        shape,
        centre: [0.0, 0.0],
        scale: 1.0,
    };
    let image = Rgb8View::new(1, 1, &[255, 0, 51]).unwrap();
    let colours = Normalisation {
        mean: [0.5, 0.5, 0.0],
        deviation: [0.5, 0.25, 1.0],
    };
    let mut out = [f32::NAN; 3];
    Sampler::default().sample(image, &tile, &colours, &mut out);
    assert_eq!(out, [1.0, -2.0, 0.2]);
}

/// The weighted mean of the frame's pixels, computed as a single formula in f64.
fn reference(size: [usize; 2], data: &[u8], tile: &Tile, [row, col, channel]: [usize; 3]) -> f64 {
    let reach = tile.scale.max(1.0);
    let TileShape { height, width } = tile.shape;
    let at =
        |i: usize, n: usize, centre: f64| centre + (i as f64 - (n as f64 - 1.0) / 2.0) * tile.scale;
    let (x, y) = (
        at(col, width, tile.centre[0]),
        at(row, height, tile.centre[1]),
    );
    let weight = |value: i64, at: f64| (1.0 - (value as f64 - at).abs() / reach).max(0.0);
    let span = |at: f64| (at - reach).floor() as i64..=(at + reach).ceil() as i64;
    let (mut sum, mut total) = (0.0, 0.0);
    for v in span(y) {
        for u in span(x) {
            let w = weight(v, y) * weight(u, x);
            let pixel = [
                u.clamp(0, size[0] as i64 - 1),
                v.clamp(0, size[1] as i64 - 1),
            ]
            .map(|value| value as usize);
            sum += w * f64::from(data[3 * (pixel[1] * size[0] + pixel[0]) + channel]);
            total += w;
        }
    }
    sum / total
}

fn scene() -> impl Strategy<Value = ([usize; 2], Vec<u8>, Tile)> {
    let shape = (1..12_usize, 1..9_usize).prop_map(|(height, width)| TileShape { height, width });
    let tile = (shape, -20.0..50.0_f64, -20.0..50.0_f64, 0.05..9.0_f64).prop_map(
        |(shape, x, y, scale)| Tile {
            shape,
            centre: [x, y],
            scale,
        },
    );
    (1..30_usize, 1..30_usize, tile).prop_flat_map(|(width, height, tile)| {
        let data = prop::collection::vec(any::<u8>(), 3 * width * height);
        data.prop_map(move |data| ([width, height], data, tile))
    })
}

proptest! {
    #[test]
    fn resampling_is_the_documented_weighted_mean((size, data, tile) in scene()) {
        let out = sampled(size, &data, &tile);
        let TileShape { height, width } = tile.shape;
        for (i, value) in out.iter().enumerate() {
            let place = [i / width % height, i % width, i / (height * width)];
            let want = reference(size, &data, &tile, place);
            prop_assert!((f64::from(*value) - want).abs() < 1e-3, "{value} {want} at {place:?}");
        }
    }

    #[test]
    fn reused_buffers_have_no_effect_on_a_tile((size, data, tile) in scene(), (other, bytes, first) in scene()) {
        let mut sampler = Sampler::default();
        let mut out = vec![f32::NAN; first.shape.n_values()];
        sampler.sample(Rgb8View::new(other[0], other[1], &bytes).unwrap(), &first, &PLAIN, &mut out);
        let mut out = vec![f32::NAN; tile.shape.n_values()];
        sampler.sample(Rgb8View::new(size[0], size[1], &data).unwrap(), &tile, &PLAIN, &mut out);
        prop_assert_eq!(out, sampled(size, &data, &tile));
    }
}
