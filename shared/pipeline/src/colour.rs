//! The colour of a person's trunk in a picture, which helps to tell people apart.

use kernels::Rgb8View;

use crate::network_memory::median;
use crate::placed::N;

/// The joints of the trunk: right and left hip; the next constant has the right and left shoulder.
const HIPS: [usize; 2] = [2, 3];
const SHOULDERS: [usize; 2] = [8, 9];
/// Number of samples along the trunk from the shoulders to the hips; the next constant is the number across the trunk.
const DOWN: usize = 7;
const ACROSS: usize = 5;
/// The sampled area of the trunk, as fractions of its height and of its width. Nearer to its edges, there are often collars, belts, arms or
/// background.
const HEIGHT: [f32; 2] = [0.15, 0.85];
const WIDTH: [f32; 2] = [0.25, 0.75];

/// Returns the median red, green and blue of the trunk, 0 to 1; `None` if a shoulder or a hip is not seen, or if the trunk is outside the
/// picture.
///
/// * `joints`: positions of the joints, in pixels of the picture.
pub(crate) fn trunk_colour(
    image: Rgb8View<'_>,
    joints: &[Option<[f32; 2]>; N],
) -> Option<[f32; 3]> {
    let [top, bottom] = [SHOULDERS, HIPS].map(|pair| pair.map(|joint| joints[joint]));
    let (top, bottom) = ([top[0]?, top[1]?], [bottom[0]?, bottom[1]?]);
    let mut values: [Vec<f64>; 3] = Default::default();
    for row in 0..DOWN {
        for col in 0..ACROSS {
            let down = at_share(HEIGHT, row, DOWN);
            let across = at_share(WIDTH, col, ACROSS);
            let at = [0, 1].map(|axis| {
                let [left, right] = [0, 1]
                    .map(|side| top[side][axis] + down * (bottom[side][axis] - top[side][axis]));
                left + across * (right - left)
            });
            if let Some(pixel) = pixel(image, at) {
                for (values, value) in values.iter_mut().zip(pixel) {
                    values.push(f64::from(value) / 255.0);
                }
            }
        }
    }
    if values[0].len() <= DOWN * ACROSS / 2 {
        return None;
    }
    let [red, green, blue] = values.map(|values| median(values.into_iter()));
    Some([red?, green?, blue?].map(|value| value as f32))
}

/// Returns the position of the `nth` of `n` samples between two limits, as a fraction.
fn at_share([first, last]: [f32; 2], nth: usize, n: usize) -> f32 {
    first + (last - first) * nth as f32 / (n - 1) as f32
}

fn pixel(image: Rgb8View<'_>, [x, y]: [f32; 2]) -> Option<[u8; 3]> {
    let is_inside = |at: f32, side: usize| at > -0.5 && at < side as f32 - 0.5;
    if !is_inside(x, image.width()) || !is_inside(y, image.height()) {
        return None;
    }
    let first = 3 * (y.round() as usize * image.width() + x.round() as usize);
    image.data().get(first..first + 3)?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 40 x 40 pixels: red with a blue trunk.
    fn picture() -> Vec<u8> {
        let pixel = |at: usize| {
            let (x, y) = (at % 40, at / 40);
            let is_trunk = (14..26).contains(&x) && (8..30).contains(&y);
            if is_trunk { [0, 0, 255] } else { [255, 0, 0] }
        };
        (0..1600).flat_map(pixel).collect()
    }

    fn person(shoulders: [[f32; 2]; 2], hips: [[f32; 2]; 2]) -> [Option<[f32; 2]>; N] {
        let mut joints = [None; N];
        for side in 0..2 {
            joints[SHOULDERS[side]] = Some(shoulders[side]);
            joints[HIPS[side]] = Some(hips[side]);
        }
        joints
    }

    #[test]
    fn the_colour_is_measured_on_the_trunk_and_not_on_the_background() {
        let data = picture();
        let image = Rgb8View::new(40, 40, &data).unwrap();
        let front = person([[13.0, 9.0], [27.0, 9.0]], [[15.0, 29.0], [25.0, 29.0]]);
        assert_eq!(trunk_colour(image, &front), Some([0.0, 0.0, 1.0]));
        let from_the_side = person([[20.0, 9.0], [20.5, 9.0]], [[20.0, 29.0], [20.0, 29.0]]);
        assert_eq!(trunk_colour(image, &from_the_side), Some([0.0, 0.0, 1.0]));
    }

    #[test]
    fn an_unseen_trunk_has_no_colour() {
        let data = picture();
        let image = Rgb8View::new(40, 40, &data).unwrap();
        let mut half = person([[13.0, 9.0], [27.0, 9.0]], [[15.0, 29.0], [25.0, 29.0]]);
        half[HIPS[0]] = None;
        assert_eq!(trunk_colour(image, &half), None);
        let outside = person([[50.0, 9.0], [60.0, 9.0]], [[50.0, 29.0], [60.0, 29.0]]);
        assert_eq!(trunk_colour(image, &outside), None);
        let nowhere = person([[f32::NAN; 2]; 2], [[f32::INFINITY; 2]; 2]);
        assert_eq!(trunk_colour(image, &nowhere), None);
    }
}
