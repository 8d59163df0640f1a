//! Tests of windows of pictures, and of the coordinates of networks in them.

use proptest::prelude::*;

use super::*;
use crate::card::{Colour, Refine, Score, tests::card};
use crate::decode::HeatMaps;

#[test]
fn a_widened_box_has_the_shape_of_the_input_and_holds_the_box() {
    // The input is 96 wide and 128 high. The box is 100 by 100, and 125 by 125 with its margin.
    let window = Window::new(&card(), [50.0, 50.0, 150.0, 150.0]).unwrap();
    assert_eq!(window.step()[0], window.step()[1]);
    assert_eq!(window.in_picture([48.0, 64.0]), [100.0, 100.0]);
    let [left, _] = window.in_picture([0.0, 0.0]);
    assert!((left - (100.0 - 62.5)).abs() < 1e-9, "{left}");
}

#[test]
fn a_stretched_box_fills_the_input() {
    let mut card = card();
    card.crop.fit = Fit::Stretch;
    card.crop.margin = 1.0;
    let window = Window::new(&card, [50.0, 60.0, 150.0, 100.0]).unwrap();
    assert_eq!(window.in_picture([0.0, 0.0]), [50.0, 60.0]);
    assert_eq!(window.in_picture([96.0, 128.0]), [150.0, 100.0]);
}

proptest! {
    #[test]
    fn both_samplers_give_the_same_colour_at_every_point(
        x in -2.0..9.0_f64,
        y in -2.0..7.0_f64,
        whole in any::<bool>(),
        rgb in proptest::collection::vec(any::<u8>(), 3 * 7 * 5),
    ) {
        let at = if whole { [x.floor(), y.floor()] } else { [x, y] };
        let both = [sample, sample_anywhere].map(|sampler| sampler(&rgb, [7, 5], at, 12.5));
        prop_assert_eq!(both[0], both[1]);
    }
}

#[test]
fn a_box_without_extent_has_no_window() {
    for outline in [
        [1.0, 1.0, 1.0, 5.0],
        [5.0, 1.0, 2.0, 5.0],
        [f64::NAN, 1.0, 2.0, 5.0],
        [0.0, 1.0, f64::INFINITY, 5.0],
    ] {
        assert_eq!(Window::new(&card(), outline), None, "{outline:?}");
    }
}

#[test]
fn the_input_is_the_picture_prepared_as_the_card_says() {
    let mut card = card();
    (card.crop.margin, card.crop.fill) = (1.0, 9);
    (card.input.scale, card.input.mean, card.input.std) = (0.5, [1.0, 2.0, 3.0], [2.0, 4.0, 8.0]);
    // The picture has a single colour. In the middle of the window, one pixel of the picture is one pixel of the input.
    let rgb: Vec<u8> = [10, 20, 30].repeat(96 * 128);
    let window = Window::new(&card, [0.0, 0.0, 96.0, 128.0]).unwrap();
    let mut values = vec![f32::NAN; 3 * 96 * 128];
    window.fill(&card, &rgb, [96, 128], &mut values);
    let plane = 96 * 128;
    assert_eq!(
        [values[0], values[plane], values[2 * plane]],
        [2.0, 2.0, 1.5]
    );
    card.input.colour = Colour::Bgr;
    card.input.layout = Layout::Pixels;
    window.fill(&card, &rgb, [96, 128], &mut values);
    assert_eq!(values[..3], [7.0, 2.0, 0.25]);
    // This window is outside the picture.
    let far = Window::new(&card, [500.0, 0.0, 596.0, 128.0]).unwrap();
    far.fill(&card, &rgb, [96, 128], &mut values);
    assert_eq!(values[..3], [1.75, 0.625, 0.1875]);
}

proptest! {
    #[test]
    fn mapping_a_point_forth_and_back_gives_the_same_point(
        corner in [-500.0..2000.0, -500.0..2000.0_f64], size in [1.0..900.0, 1.0..900.0_f64],
        at in [-100.0..500.0, -100.0..500.0_f64],
    ) {
        let outline = [corner[0], corner[1], corner[0] + size[0], corner[1] + size[1]];
        let window = Window::new(&card(), outline).unwrap();
        let back = window.in_input(window.in_picture(at));
        prop_assert!((0..2).all(|axis| (back[axis] - at[axis]).abs() < 1e-6), "{:?}", back);
    }
}

#[test]
fn a_grid_holds_the_box_in_square_cells() {
    let window = Window::grid([100.0, 50.0, 300.0, 450.0], 1.25, 64).unwrap();
    assert_eq!(window.input(), [32, 64]);
    assert_eq!(window.step(), [7.8125; 2]);
    assert_eq!(window.in_picture([16.0, 32.0]), [200.0, 250.0]);
    let small = Window::grid([0.0, 0.0, 20.0, 24.0], 1.25, 64).unwrap();
    assert_eq!((small.input(), small.step()), ([25, 30], [1.0; 2]));
}

#[test]
fn a_grid_over_a_line_or_a_point_is_widened_but_stays_small() {
    for outline in [
        [10.0, 5.0, 900.0, 5.0],
        [10.0, 5.0, 10.0, 900.0],
        [10.0, 5.0, 10.0, 5.0],
        [-1e6, -1e6, 1e6, 1e6],
    ] {
        let window = Window::grid(outline, 1.25, 64).unwrap();
        let [columns, rows] = window.input();
        assert!((8..=64).contains(&rows) && (8..=257).contains(&columns));
        for corner in [[outline[0], outline[1]], [outline[2], outline[3]]] {
            let [x, y] = window.in_input(corner);
            assert!(x >= 0.0 && x <= columns as f64 && y >= 0.0 && y <= rows as f64);
        }
    }
    assert_eq!(Window::grid([0.0, 0.0, f64::NAN, 1.0], 1.25, 64), None);
    assert_eq!(Window::grid([5.0, 0.0, 1.0, 1.0], 1.25, 64), None);
    assert_eq!(Window::grid([f64::MIN, 0.0, f64::MAX, 1.0], 1.25, 64), None);
}

#[test]
fn the_box_encloses_the_keypoints_that_were_found() {
    let at = |x, y, score| Some(Keypoint { at: [x, y], score });
    let all = [
        at(5.0, 9.0, 0.1),
        None,
        at(0.0, 0.0, 0.0),
        at(7.0, 2.0, 1.0),
    ];
    assert_eq!(outline(&all), Some([5.0, 2.0, 7.0, 9.0]));
    assert_eq!(outline(&all[1..3]), None);
}

/// Returns a card with the maps of a network that was trained with or without unbiased coordinates.
fn udp_card(udp: bool) -> Card {
    let mut card = card();
    if let Codec::HeatMap { udp: it, .. } = &mut card.output {
        *it = udp;
    }
    card
}

/// Maps a column or row of the picture to the corresponding one of the input, by the matrix of mmpose's `get_udp_warp_matrix` without a
/// rotation.
fn warped(x: f64, centre: f64, size: f64, side: f64) -> f64 {
    let scale = (side - 1.0) / size;
    scale * x + scale * (-0.5 * (2.0 * centre) + 0.5 * size)
}

/// Maps a column or row of a map to the corresponding one of the picture, as mmpose's `UDPHeatmap` decodes it and its estimator converts it
/// back.
fn decoded(cell: f64, cells: f64, [centre, size, side]: [f64; 3]) -> f64 {
    let in_input = cell / (cells - 1.0) * side;
    in_input / side * size + centre - 0.5 * size
}

proptest! {
    #[test]
    fn unbiased_coordinates_follow_the_definition_in_both_directions(
        corner in [-500.0..2000.0, -500.0..2000.0_f64], size in [1.0..900.0, 1.0..900.0_f64],
        at in [-100.0..3000.0, -100.0..3000.0_f64], cell in [0_usize..24, 0_usize..32],
    ) {
        let card = udp_card(true);
        let outline = [corner[0], corner[1], corner[0] + size[0], corner[1] + size[1]];
        let window = Window::new(&card, outline).unwrap();
        let sides = [96.0, 128.0];
        let wide = (1.25 * size[0]).max(1.25 * size[1] * 0.75);
        let sizes = [wide, wide / 0.75];
        let mut values = vec![0.0; 24 * 32];
        values[cell[1] * 24 + cell[0]] = 1.0;
        let maps = HeatMaps::new(&values, &[1, 1, 32, 24], Layout::Planes, [1, 0]).unwrap();
        let found = maps.keypoints([96, 128], true, Refine::None, Score::Share)[0];
        let (input, picture) = (window.in_input(at), window.in_picture(found.at));
        for axis in 0..2 {
            let centre = corner[axis] + size[axis] / 2.0;
            let expected = warped(at[axis], centre, sizes[axis], sides[axis]);
            prop_assert!((input[axis] - expected).abs() < 1e-6 * (1.0 + expected.abs()));
            let cells = [24.0, 32.0][axis];
            let expected = decoded(cell[axis] as f64, cells, [centre, sizes[axis], sides[axis]]);
            prop_assert!((picture[axis] - expected).abs() < 1e-6, "{} {expected}", picture[axis]);
        }
    }
}

#[test]
fn unbiased_corner_pixels_lie_on_the_edges_of_the_box() {
    let mut card = udp_card(true);
    card.crop.margin = 1.0;
    let window = Window::new(&card, [50.0, 60.0, 146.0, 188.0]).unwrap();
    let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-9);
    assert!(near(window.in_picture([0.0, 0.0]), [50.0, 60.0]));
    assert!(near(window.in_picture([95.0, 127.0]), [146.0, 188.0]));
    assert!(near(window.in_picture([47.5, 63.5]), [98.0, 124.0]));
    // Without unbiased data processing, the middle is half the width, and a pixel of this box is one pixel of the input.
    let window = Window::new(&udp_card(false), [50.0, 60.0, 146.0, 188.0]).unwrap();
    assert_eq!(window.in_picture([48.0, 64.0]), [98.0, 124.0]);
}

#[test]
fn an_unbiased_box_of_the_input_size_gives_the_picture_itself() {
    let mut card = udp_card(true);
    (card.crop.margin, card.crop.fit) = (1.0, Fit::Stretch);
    let rgb: Vec<u8> = (0..3 * 96 * 128).map(|i| (i * 7 % 251) as u8).collect();
    let window = Window::new(&card, [0.0, 0.0, 95.0, 127.0]).unwrap();
    let mut values = vec![f32::NAN; rgb.len()];
    window.fill(&card, &rgb, [96, 128], &mut values);
    for (pixel, colour) in rgb.chunks_exact(3).enumerate() {
        for (channel, it) in colour.iter().enumerate() {
            let value = values[channel * 96 * 128 + pixel];
            assert!(
                (value - f32::from(*it)).abs() < 1e-2,
                "{pixel}: {value} {it}"
            );
        }
    }
}
