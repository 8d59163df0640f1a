//! Warns if a large part of the frames is padding, because their aspect ratio differs from that of the camera's image.

/// Minimum fraction of padding in a frame that is reported.
const MIN_SHARE: f64 = 0.1;

/// Returns a warning that names the cameras in whose frames a large part is padding, if there are any.
///
/// * `frame`: width and height of the frames, in pixels.
/// * `cameras`: name, and width and height of the image in pixels, of every camera.
pub(crate) fn warning(frame: [usize; 2], cameras: &[(&str, [u32; 2])]) -> Option<String> {
    let padded = cameras.iter().filter(|camera| share(camera.1, frame) > MIN_SHARE);
    let padded: Vec<(&str, [u32; 2])> = padded.copied().collect();
    let (_, image) = *padded.first()?;
    let names: Vec<&str> = padded
        .iter()
        .filter(|padded| padded.1 == image)
        .map(|padded| padded.0)
        .collect();
    let [width, height] = fitting(image, frame);
    Some(format!(
        "{:.0} % of every {}x{} frame of {} is padding, because the camera's image has {}x{} pixels: searching the padding wastes \
         time, and the person is small. Try capture.size = [{width}, {height}], or replace it by capture.scale = {:.3}",
        100.0 * share(image, frame),
        frame[0],
        frame[1],
        names.join(", "),
        image[0],
        image[1],
        f64::from(width) / f64::from(image[0])
    ))
}

/// Returns the factor by which an image is scaled to fit into a frame.
fn scale(image: [u32; 2], frame: [usize; 2]) -> f64 {
    let of_axis = |axis: usize| frame[axis] as f64 / f64::from(image[axis].max(1));
    of_axis(0).min(of_axis(1))
}

/// Returns the fraction of a frame that remains empty when an image is scaled to fit into it.
fn share(image: [u32; 2], frame: [usize; 2]) -> f64 {
    let scale = scale(image, frame);
    let area = f64::from(image[0]) * f64::from(image[1]) * scale * scale;
    1.0 - area / (frame[0] as f64 * frame[1] as f64)
}

/// Returns the size of the image when it is scaled to fit into the frame, in pixels.
fn fitting(image: [u32; 2], frame: [usize; 2]) -> [u32; 2] {
    let scale = scale(image, frame);
    image.map(|image| (f64::from(image) * scale).round().max(1.0) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_portrait_in_a_landscape_is_mostly_padding() {
        let image = [1088, 1920];
        assert!((share(image, [640, 480]) - 0.575).abs() < 1e-3);
        assert_eq!(fitting(image, [640, 480]), [272, 480]);
        assert!(share(image, [272, 480]).abs() < 1e-9);
    }

    #[test]
    fn the_same_aspect_ratio_needs_no_padding() {
        for frame in [[640, 480], [320, 240], [1280, 960]] {
            assert!(share([640, 480], frame).abs() < 1e-9, "{frame:?}");
            assert_eq!(fitting([640, 480], frame), frame.map(|frame| frame as u32));
        }
    }
}
