//! Values on the command line.

/// A box: left, top, right, bottom, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline(
    /// Left, top, right, bottom.
    pub [f64; 4],
);

/// Parses a box on the command line.
///
/// # Errors
///
/// Fails if the text is not four numbers, or if the box has no extent.
pub fn outline(text: &str) -> Result<Outline, String> {
    let numbers: Result<Vec<f64>, _> =
        text.split(',').map(|number| number.trim().parse()).collect();
    let corners = numbers.ok().and_then(|four| <[f64; 4]>::try_from(four).ok());
    let is_box = |[left, top, right, bottom]: &[f64; 4]| {
        [left, top, right, bottom].iter().all(|edge| edge.is_finite())
            && left < right
            && top < bottom
    };
    let corners = corners.filter(is_box);
    corners.map(Outline).ok_or_else(|| {
        format!(
            "expected left,top,right,bottom in pixels, left < right and top < bottom, got {text:?}"
        )
    })
}

/// Parses a frame rate on the command line, in frames per second.
///
/// # Errors
///
/// Fails if the text is not a number from 0.1 to 1000.
pub fn rate(text: &str) -> Result<f64, String> {
    let rate: Option<f64> = text.parse().ok();
    let rate = rate.filter(|rate| (0.1..=1000.0).contains(rate));
    rate.ok_or_else(|| "expected 0.1 to 1000 frames per second".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_four_numbers_and_an_extent() {
        assert_eq!(outline("1,2, 3.5,4"), Ok(Outline([1.0, 2.0, 3.5, 4.0])));
        assert_eq!(outline("-5,-2,3,4"), Ok(Outline([-5.0, -2.0, 3.0, 4.0])));
        for text in [
            "",
            "1,2,3",
            "1,2,3,4,5",
            "3,2,1,4",
            "1,4,3,4",
            "1,2,nan,4",
            "0,0,inf,1",
        ] {
            assert!(outline(text).is_err(), "{text}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_makes_the_parsers_panic(text in "[0-9,.a-z -]{0,12}") {
            drop(rate(&text));
            drop(outline(&text));
        }
    }
}
