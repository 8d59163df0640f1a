//! Warps of images with a known result.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use footage::{Affine, Fill, Size, Warp, WarpError, resize_map, shrunk_map};
use proptest::prelude::*;

/// Returns an image whose pixels are a function of their position.
fn image(size: Size, pixel: impl Fn(usize, usize) -> [u8; 3]) -> Vec<u8> {
    let places = (0..size.height).flat_map(|y| (0..size.width).map(move |x| (x, y)));
    places.flat_map(|(x, y)| pixel(x, y)).collect()
}

fn noise(size: Size) -> Vec<u8> {
    image(size, |x, y| {
        let mixed = (x as u32 * 7919 + y as u32 * 104_729).wrapping_mul(2_654_435_761);
        [(mixed >> 24) as u8, (mixed >> 16) as u8, (mixed >> 8) as u8]
    })
}

fn warp(source: Size, rgb: &[u8], output: Size, map: &Affine, fill: Fill) -> Vec<u8> {
    let mut out = vec![99; output.rgb_bytes()];
    Warp::new(source, output, map, fill).unwrap().apply(rgb, &mut out);
    out
}

/// Returns the map that rotates by `degrees` and shrinks by `scale`, about the centres of both images.
fn turn(source: Size, output: Size, degrees: f64, scale: f64) -> Affine {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let centre = |value: usize| (value as f64 - 1.0) / 2.0;
    let linear = [[scale * cos, -scale * sin], [scale * sin, scale * cos]];
    let [cx, cy] = [centre(output.width), centre(output.height)];
    let towards = [centre(source.width), centre(source.height)];
    std::array::from_fn(|i| {
        let [a, b] = linear[i];
        [a, b, towards[i] - a * cx - b * cy]
    })
}

fn at(rgb: &[u8], size: Size, x: usize, y: usize) -> [u8; 3] {
    rgb[(y * size.width + x) * 3..][..3].try_into().unwrap()
}

#[test]
fn the_identity_copies_the_image() {
    let size = Size::new(13, 7);
    let map = resize_map(size, size);
    assert_eq!(map, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(
        warp(size, &noise(size), size, &map, Fill::Black),
        noise(size)
    );
}

#[test]
fn a_shift_by_whole_pixels_moves_the_image_and_fills_the_border() {
    let size = Size::new(13, 7);
    let source = noise(size);
    let map = [[1.0, 0.0, 3.0], [0.0, 1.0, -2.0]];
    for (fill, outside) in [(Fill::Black, None), (Fill::Replicate, Some(()))] {
        let out = warp(size, &source, size, &map, fill);
        for (x, y) in (0..size.width).flat_map(|x| (0..size.height).map(move |y| (x, y))) {
            let (u, v) = (x as i64 + 3, y as i64 - 2);
            let nearest = at(
                &source,
                size,
                u.clamp(0, 12) as usize,
                v.clamp(0, 6) as usize,
            );
            let is_there = (0..13).contains(&u) && (0..7).contains(&v);
            let expect = if is_there || outside.is_some() {
                nearest
            } else {
                [0; 3]
            };
            assert_eq!(at(&out, size, x, y), expect, "{fill:?} at {x}, {y}");
        }
    }
}

#[test]
fn halving_takes_the_mean_of_four_pixels_rounded_half_up() {
    let (source, output) = (Size::new(20, 12), Size::new(10, 6));
    let rgb = noise(source);
    let out = warp(
        source,
        &rgb,
        output,
        &resize_map(source, output),
        Fill::Black,
    );
    let expect = image(output, |x, y| {
        std::array::from_fn(|channel| {
            let value = |i, j| u32::from(at(&rgb, source, 2 * x + i, 2 * y + j)[channel]);
            ((value(0, 0) + value(1, 0) + value(0, 1) + value(1, 1) + 2) / 4) as u8
        })
    });
    assert_eq!(out, expect);
}

#[test]
fn a_quarter_turn_permutes_pixels() {
    let (source, output) = (Size::new(9, 14), Size::new(14, 9));
    let rgb = noise(source);
    // Output (x, y) shows source (8 - y, x), so the picture is rotated counter-clockwise.
    let map = [[0.0, -1.0, 8.0], [1.0, 0.0, 0.0]];
    let out = warp(source, &rgb, output, &map, Fill::Black);
    assert_eq!(out, image(output, |x, y| at(&rgb, source, 8 - y, x)));
}

#[test]
fn a_negative_factor_mirrors() {
    let size = Size::new(9, 5);
    let rgb = noise(size);
    let map = [[-1.0, 0.0, 8.0], [0.0, 1.0, 0.0]];
    let out = warp(size, &rgb, size, &map, Fill::Black);
    assert_eq!(out, image(size, |x, y| at(&rgb, size, 8 - x, y)));
}

#[test]
fn pixels_outside_are_black_or_the_nearest() {
    let (source, output) = (Size::new(40, 40), Size::new(40, 40));
    let rgb = vec![200; source.rgb_bytes()];
    let map = turn(source, output, 30.0, 1.5);
    let black = warp(source, &rgb, output, &map, Fill::Black);
    assert_eq!(at(&black, output, 0, 0), [0; 3]);
    assert_eq!(at(&black, output, 20, 20), [200; 3]);
    let replicated = warp(source, &rgb, output, &map, Fill::Replicate);
    assert!(replicated.iter().all(|&grey| grey == 200));
}

#[test]
fn refuses_empty_images_and_invalid_maps() {
    let size = Size::new(8, 8);
    let refusal =
        |source, output, map: Affine| Warp::new(source, output, &map, Fill::Black).unwrap_err();
    let identity = resize_map(size, size);
    assert!(matches!(
        refusal(Size::new(0, 8), size, identity),
        WarpError::Empty { .. }
    ));
    assert!(matches!(
        refusal(size, Size::new(8, 0), identity),
        WarpError::Empty { .. }
    ));
    for bad in [f64::NAN, f64::INFINITY, 1e9] {
        let map = [[1.0, 0.0, bad], [0.0, 1.0, 0.0]];
        assert!(
            matches!(refusal(size, size, map), WarpError::BadMap { .. }),
            "{bad}"
        );
    }
    let flat = [[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]];
    assert!(matches!(
        refusal(size, size, flat),
        WarpError::BadMap { .. }
    ));
    let tiny = resize_map(Size::new(1000, 8), Size::new(10, 8));
    assert!(matches!(
        refusal(size, size, tiny),
        WarpError::ShrinksTooMuch { .. }
    ));
}

proptest! {
    #[test]
    fn a_constant_image_stays_constant(
        value: u8, degrees in -180.0..180.0, scale in 0.3..9.0, keeps_rows: bool,
    ) {
        let (source, output) = (Size::new(50, 40), Size::new(12, 14));
        let degrees = if keeps_rows { 0.0 } else { degrees };
        let map = turn(source, output, degrees, scale);
        let rgb = vec![value; source.rgb_bytes()];
        let out = warp(source, &rgb, output, &map, Fill::Replicate);
        // The area is rounded to f32, which does not change the grey level.
        prop_assert!(out.iter().all(|&grey| grey == value));
    }

    #[test]
    fn any_shrinking_resize_is_the_area_mean(
        width in 1_usize..40, height in 1_usize..30, shrunk_x in 0.05..1.0, shrunk_y in 0.05..1.0,
    ) {
        let source = Size::new(width, height);
        let shrunk = |side: usize, by: f64| ((side as f64 * by).round() as usize).max(1);
        let output = Size::new(shrunk(width, shrunk_x), shrunk(height, shrunk_y));
        let rgb = noise(source);
        let out = warp(source, &rgb, output, &resize_map(source, output), Fill::Black);
        let share = |pixel: usize, at: usize, n_source: usize, n_output: usize| {
            let step = n_source as f64 / n_output as f64;
            let (low, high) = (at as f64 * step, (at as f64 + 1.0) * step);
            (high.min(pixel as f64 + 1.0) - low.max(pixel as f64)).max(0.0) / step
        };
        for (x, y) in (0..output.width).flat_map(|x| (0..output.height).map(move |y| (x, y))) {
            for channel in 0..3 {
                let mut mean = 0.0;
                for (i, j) in (0..width).flat_map(|i| (0..height).map(move |j| (i, j))) {
                    mean += share(i, x, width, output.width)
                        * share(j, y, height, output.height)
                        * f64::from(at(&rgb, source, i, j)[channel]);
                }
                let found = f64::from(at(&out, output, x, y)[channel]);
                prop_assert!((found - mean).abs() <= 0.5 + 1e-3, "{found} for {mean}");
            }
        }
    }

    /// Red is the column and green the row, so the output shows the map itself.
    #[test]
    fn a_ramp_is_warped_by_the_affine_map(
        degrees in -180.0..180.0, scale in 0.4..6.0, dx in -3.0..3.0, dy in -3.0..3.0,
    ) {
        ramp_shows(degrees, scale, [dx, dy])?;
    }
}

/// Reference: bilinear samples in f64, with positions rounded to 1/32 pixel.
struct Reference<'a> {
    source: Size,
    rgb: &'a [u8],
    map: Affine,
    fill: Fill,
}

impl Reference<'_> {
    fn value(&self, x: f64, y: f64, channel: usize) -> f64 {
        let last = [
            self.source.width as f64 - 1.0,
            self.source.height as f64 - 1.0,
        ];
        let is_there = (0.0..=last[0]).contains(&x) && (0.0..=last[1]).contains(&y);
        if !is_there && self.fill == Fill::Black {
            return 0.0;
        }
        let (x, y) = (x.clamp(0.0, last[0]), y.clamp(0.0, last[1]));
        f64::from(at(self.rgb, self.source, x as usize, y as usize)[channel])
    }

    fn bilinear(&self, [u, v]: [f64; 2], channel: usize) -> f64 {
        let (x, y) = (u.floor(), v.floor());
        let corners = [[x, y], [x + 1.0, y], [x, y + 1.0], [x + 1.0, y + 1.0]];
        let weighted = corners.map(|[x, y]| {
            (1.0 - (u - x).abs()) * (1.0 - (v - y).abs()) * self.value(x, y, channel)
        });
        weighted.iter().sum()
    }

    /// Returns a pixel; `None` if rounding the position of the centre is ambiguous.
    fn pixel(&self, x: usize, y: usize) -> Option<[f64; 3]> {
        let centre = self.map.map(|[a, b, t]| (a * x as f64 + b * y as f64 + t) * 32.0);
        if centre.iter().any(|value| ((value + 0.5) - (value + 0.5).round()).abs() < 1e-5) {
            return None;
        }
        let place = centre.map(|value| value.round() / 32.0);
        Some(std::array::from_fn(|channel| self.bilinear(place, channel)))
    }
}

proptest! {
    #[test]
    fn a_rotated_image_consists_of_bilinear_samples_up_to_its_border(
        degrees in 1.0..359.0, scale in 0.4..1.05, dx in -20.0..20.0, dy in -20.0..20.0, is_black: bool,
    ) {
        let (source, output) = (Size::new(31, 26), Size::new(13, 11));
        let rgb = noise(source);
        let mut map = turn(source, output, degrees, scale);
        map[0][2] += dx;
        map[1][2] += dy;
        let fill = if is_black { Fill::Black } else { Fill::Replicate };
        let out = warp(source, &rgb, output, &map, fill);
        let reference = Reference { source, rgb: &rgb, map, fill };
        for (x, y) in (0..output.width).flat_map(|x| (0..output.height).map(move |y| (x, y))) {
            let Some(expect) = reference.pixel(x, y) else { continue };
            for (found, expect) in at(&out, output, x, y).into_iter().zip(expect) {
                let error = (f64::from(found) - expect).abs();
                prop_assert!(error < 0.6, "{found} for {expect} at {x}, {y}");
            }
        }
    }

    #[test]
    fn an_image_is_shrunk_before_it_is_rotated(
        degrees in 1.0..359.0, dx in -20.0..20.0, dy in -20.0..20.0, is_black: bool,
    ) {
        const BY: f64 = 1.5;
        let (source, small, output) = (Size::new(48, 39), Size::new(32, 26), Size::new(13, 11));
        let rgb = noise(source);
        let mut map = turn(source, output, degrees, BY);
        map[0][2] += dx;
        map[1][2] += dy;
        let fill = if is_black { Fill::Black } else { Fill::Replicate };
        let at_once = warp(source, &rgb, output, &map, fill);
        let shrunk = warp(source, &rgb, small, &resize_map(source, small), Fill::Replicate);
        let rotated = warp(small, &shrunk, output, &shrunk_map(&map, BY), fill);
        // The scale is computed from the map, so a position may be rounded to the next 1/32 pixel.
        let largest = at_once.iter().zip(&rotated).map(|(a, b)| a.abs_diff(*b)).max();
        prop_assert!(largest <= Some(255 / 32 + 1), "{largest:?}");
    }
}

#[test]
fn a_ramp_is_warped_by_the_map_of_a_rolled_camera() {
    ramp_shows(28.0, 4.0, [0.0, 0.0]).unwrap();
}

fn ramp_shows(degrees: f64, scale: f64, shift: [f64; 2]) -> Result<(), TestCaseError> {
    let (source, output) = (Size::new(200, 160), Size::new(25, 20));
    let rgb = image(source, |x, y| [x as u8, y as u8, 255 - x as u8]);
    let mut map = turn(source, output, degrees, scale);
    map[0][2] += shift[0];
    map[1][2] += shift[1];
    let out = warp(source, &rgb, output, &map, Fill::Black);
    for (x, y) in (0..output.width).flat_map(|x| (0..output.height).map(move |y| (x, y))) {
        let [u, v] = map.map(|[a, b, t]| a * x as f64 + b * y as f64 + t);
        let margin = 2.0 * scale + 1.0;
        if u < margin || v < margin || u > 199.0 - margin || v > 159.0 - margin {
            continue;
        }
        let found = at(&out, output, x, y).map(f64::from);
        for (found, expect) in found.into_iter().zip([u, v, 255.0 - u]) {
            // The tolerance is half a grey level for each of two roundings, plus half a step of positions.
            prop_assert!(
                (found - expect).abs() < 1.0 + scale / 64.0 + 0.01,
                "{found} for {expect} at {x}, {y}"
            );
        }
    }
    Ok(())
}
