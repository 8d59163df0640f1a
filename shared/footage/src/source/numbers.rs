//! The numbers in the names of pictures, and how frames are numbered by means of the numbers of all cameras.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::listing::{self, Listing, runs};
use crate::{FootageError, PictureNumbers};

/// A picture of a sequence, and its frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbered {
    pub(super) path: PathBuf,
    /// Number of the frame, counted from 0.
    pub(super) frame: u64,
}

/// Returns the frame of each picture, by the numbers in the names if `numbers` is given, otherwise in order.
///
/// Pictures whose numbers lie before the first frame or between two frames are left out.
pub(super) fn frames(paths: Vec<PathBuf>, numbers: Option<PictureNumbers>) -> Vec<Numbered> {
    let told = numbers.and_then(|numbers| Some((numbers, numbers_of(&paths)?)));
    let Some((PictureNumbers { first, step }, numbers)) = told else {
        let all = paths.into_iter().zip(0..);
        return all.map(|(path, frame)| Numbered { path, frame }).collect();
    };
    let frame = |number: u64| {
        let above = number.checked_sub(first)?;
        above.is_multiple_of(step.max(1)).then(|| above / step.max(1))
    };
    let all = paths.into_iter().zip(numbers);
    all.filter_map(|(path, number)| {
        Some(Numbered {
            path,
            frame: frame(number)?,
        })
    })
    .collect()
}

/// Returns the distinct numbers of pictures, ascending; `None` if the pictures are not numbered.
///
/// * `paths`: paths of the pictures, in natural order.
fn numbers_of(paths: &[PathBuf]) -> Option<Vec<u64>> {
    let texts: Vec<String> = paths
        .iter()
        .map(|path| path.with_extension("").to_string_lossy().into_owned())
        .collect();
    let all: Vec<Vec<&str>> = texts.iter().map(|text| runs(text)).collect();
    let first = all.first()?;
    let is_number = |text: &str| text.starts_with(|letter: char| letter.is_ascii_digit());
    let is_alike = |row: &Vec<&str>| {
        let mut pairs = row.iter().zip(first);
        row.len() == first.len() && pairs.all(|(a, b)| a == b || (is_number(a) && is_number(b)))
    };
    if !all.iter().all(is_alike) {
        return None;
    }
    let column = |nth: usize| -> Option<Vec<u64>> {
        let numbers = all.iter().map(|row| row[nth].parse().ok());
        let numbers: Vec<u64> = numbers.collect::<Option<_>>()?;
        numbers.is_sorted_by(|a, b| a < b).then_some(numbers)
    };
    // Names may contain several numbers that ascend, such as a number and a time. The numbers with the smallest gaps are used; in a tie,
    // those that come last in the names.
    let rising = (0..first.len()).rev().filter_map(column);
    rising.min_by_key(|numbers| numbers[numbers.len() - 1] - numbers[0])
}

/// Returns the numbers of the pictures of a folder, a pattern or a glob, ascending. Returns `None` for other footage, and for pictures
/// that are not numbered.
///
/// # Errors
///
/// Fails if there is no such footage, or if it cannot be read.
pub fn picture_numbers(path: &str) -> Result<Option<Vec<u64>>, FootageError> {
    Ok(match listing::list(path)? {
        Listing::Images(paths) => numbers_of(&paths),
        Listing::File(_) => None,
    })
}

/// How the pictures of several cameras are numbered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Counting {
    /// In order, because the numbers in the names are too far apart to be frame numbers.
    InOrder,
    /// By the numbers in the names, which mean the same frames for all cameras.
    Common(PictureNumbers),
    /// By the numbers in the names, but starting from each camera's own first number, because the ranges of the cameras hardly overlap.
    Own(Vec<PictureNumbers>),
}

impl Counting {
    /// Chooses how the pictures of some cameras are numbered.
    ///
    /// * `cameras`: the numbers of every camera, ascending and not empty.
    pub fn of(cameras: &[Vec<u64>]) -> Self {
        let firsts: Vec<u64> =
            cameras.iter().filter_map(|camera| camera.first().copied()).collect();
        let lasts = cameras.iter().filter_map(|camera| camera.last().copied());
        let lengths = cameras.iter().filter_map(|camera| Some(camera.last()? - camera.first()?));
        let from = firsts.iter().copied().max().unwrap_or(0);
        let both = (lasts.min().unwrap_or(0) + 1).saturating_sub(from);
        let is_common = 2 * both > lengths.min().unwrap_or(0);
        if is_common {
            let first = firsts.iter().copied().min().unwrap_or(0);
            let step = step_of(&vec![first; cameras.len()], cameras);
            return step.map_or(Self::InOrder, |step| {
                Self::Common(PictureNumbers { first, step })
            });
        }
        let step = step_of(&firsts, cameras);
        step.map_or(Self::InOrder, |step| {
            let all = firsts.into_iter();
            Self::Own(all.map(|first| PictureNumbers { first, step }).collect())
        })
    }
}

/// Returns the difference between the numbers of neighbouring frames; `None` if most frames would have no picture from any camera.
///
/// * `firsts`: the number of frame 0 of every camera.
fn step_of(firsts: &[u64], cameras: &[Vec<u64>]) -> Option<u64> {
    const MOST_FRAMES: u64 = 3;
    let all = firsts.iter().zip(cameras);
    let all = all.flat_map(|(first, it)| it.iter().map(move |value| value - first));
    let all: BTreeSet<u64> = all.collect();
    let step = all.iter().fold(0, |gcd, it| common(gcd, *it)).max(1);
    let n_frames = all.last()? / step + 1;
    (n_frames <= MOST_FRAMES * all.len() as u64).then_some(step)
}

/// Returns the greatest common divisor.
fn common(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(names: &[&str]) -> Option<Vec<u64>> {
        let paths: Vec<PathBuf> = names.iter().map(|name| PathBuf::from("c1").join(name)).collect();
        numbers_of(&paths)
    }

    #[test]
    fn the_number_that_increases_is_the_frame_number() {
        assert_eq!(numbers(&["000000.jpg", "000007.jpg"]), Some(vec![0, 7]));
        assert_eq!(numbers(&["im9.png", "im10.png"]), Some(vec![9, 10]));
        assert_eq!(
            numbers(&["a3_1_left.png", "a3_2_left.png"]),
            Some(vec![1, 2])
        );
        let with_time = ["f1_1697381001233.png", "f2_1697381001266.png"];
        assert_eq!(numbers(&with_time), Some(vec![1, 2]));
        assert_eq!(numbers(&["a_5.jpg"]), Some(vec![5]));
        for names in [
            &["a.png", "b.png"][..],
            &["im01.png", "im1.png"],
            &["IMG_1.png", "PXL_2.png"],
        ] {
            assert_eq!(numbers(names), None, "{names:?}");
        }
    }

    #[test]
    fn a_gap_is_a_frame_without_a_picture() {
        let paths = ["2.png", "3.png", "6.png"].map(PathBuf::from).to_vec();
        let at = |first, step| -> Vec<u64> {
            let numbers = Some(PictureNumbers { first, step });
            frames(paths.clone(), numbers).iter().map(|frame| frame.frame).collect()
        };
        assert_eq!(at(0, 1), [2, 3, 6]);
        assert_eq!(at(3, 1), [0, 3]);
        assert_eq!(at(2, 2), [0, 2]);
        let in_order: Vec<u64> = frames(paths, None).iter().map(|frame| frame.frame).collect();
        assert_eq!(in_order, [0, 1, 2]);
    }

    #[test]
    fn cameras_share_frame_numbers_or_each_has_its_own() {
        let range = |range: core::ops::Range<u64>| range.collect::<Vec<u64>>();
        let common = |first, step| Counting::Common(PictureNumbers { first, step });
        let gap: Vec<u64> = (0..14).filter(|i| !(3..6).contains(i)).collect();
        assert_eq!(Counting::of(&[range(0..14), gap]), common(0, 1));
        assert_eq!(Counting::of(&[range(0..14), range(3..14)]), common(0, 1));
        let fifth =
            |range: core::ops::Range<u64>| range.map(|range| 5 * range).collect::<Vec<u64>>();
        assert_eq!(Counting::of(&[fifth(2..20), fifth(2..19)]), common(10, 5));
        assert_eq!(Counting::of(&[range(7..8), range(7..8)]), common(7, 1));
        let own = |first| PictureNumbers { first, step: 1 };
        let counted = Counting::of(&[range(0..100), range(1000..1099)]);
        assert_eq!(counted, Counting::Own(vec![own(0), own(1000)]));
        let chosen = vec![12, 31, 250, 301];
        assert_eq!(Counting::of(&[chosen.clone(), chosen]), Counting::InOrder);
    }
}
