//! Response maps: the header of an array that is never copied.

use fmp::{Layout, Responses};
use messages::{EvidenceHeader, MAX_LEVELS, Stamp, Status, Timing};

use crate::WireError;
use crate::error::{count, equal, index};

/// Writes which levels are valid; the caller fills in stamp and timing.
///
/// * `levels`: ascending.
///
/// # Errors
///
/// [`WireError`] if there are more than [`MAX_LEVELS`], or they are not ascending levels of
/// `layout`.
pub fn levels_to_message(levels: &[u16], layout: &Layout) -> Result<EvidenceHeader, WireError> {
    let mut message = EvidenceHeader {
        stamp: Stamp::default(),
        timing: Timing::default(),
        width: layout.image_size[0] as u32,
        height: layout.image_size[1] as u32,
        status: Status::OK,
        n_levels: count("n_levels", levels.len(), MAX_LEVELS)? as u32,
        levels: [0; MAX_LEVELS],
    };
    ascending(levels, layout)?;
    message.levels[..levels.len()].copy_from_slice(levels);
    Ok(message)
}

/// Views the values that came with `message` as the responses of `layout`, where they lie.
///
/// # Errors
///
/// [`WireError`] if the image size is not that of `layout`, there are fewer values than it has
/// cells, or the levels are not ascending levels of it.
pub fn evidence_from_message<'a>(
    message: &'a EvidenceHeader,
    values: &'a [f32],
    layout: &'a Layout,
) -> Result<Responses<'a>, WireError> {
    equal("width", message.width as usize, layout.image_size[0])?;
    equal("height", message.height as usize, layout.image_size[1])?;
    if values.len() < layout.n_responses() {
        return Err(WireError::Mismatch {
            field: "values",
            got: values.len(),
            expected: layout.n_responses(),
        });
    }
    let n_levels = count("n_levels", message.n_levels as usize, MAX_LEVELS)?;
    let levels = &message.levels[..n_levels];
    ascending(levels, layout)?;
    Ok(Responses::new(layout, values, levels))
}

fn ascending(levels: &[u16], layout: &Layout) -> Result<(), WireError> {
    for (entry, &level) in levels.iter().enumerate() {
        index("levels", entry, usize::from(level), layout.levels.len())?;
        if entry > 0 && levels[entry - 1] >= level {
            return Err(WireError::Value {
                field: "levels",
                entry,
                got: f64::from(level),
                expected: "ascending levels",
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::layout;

    proptest! {
        #[test]
        fn the_levels_come_back_as_they_were_sent(mask in prop::collection::vec(any::<bool>(), 96)) {
            let layout = layout();
            let levels: Vec<u16> = (0..layout.levels.len() as u16)
                .filter(|&it| mask[usize::from(it)])
                .collect();
            let message = levels_to_message(&levels, &layout).unwrap();
            let values = vec![0.0; layout.n_responses()];
            let back = evidence_from_message(&message, &values, &layout).unwrap();
            prop_assert_eq!(back.levels(), levels);
        }

        #[test]
        fn whatever_arrives_is_refused_or_readable(
            n_levels in any::<u32>(),
            small in 0_u32..4,
            levels in prop::collection::vec(0_u16..20, MAX_LEVELS),
        ) {
            let layout = layout();
            let values = vec![0.0; layout.n_responses()];
            let mut message = levels_to_message(&[], &layout).unwrap();
            message.levels.copy_from_slice(&levels);
            for n in [n_levels, small] {
                message.n_levels = n;
                if let Ok(evidence) = evidence_from_message(&message, &values, &layout) {
                    for &level in evidence.levels() {
                        prop_assert!(!evidence.map(usize::from(level), 0).is_empty());
                    }
                }
            }
        }
    }

    #[test]
    fn refuses_too_few_values() {
        let layout = layout();
        let message = levels_to_message(&[0], &layout).unwrap();
        let values = vec![0.0; layout.n_responses() - 1];
        assert!(matches!(
            evidence_from_message(&message, &values, &layout),
            Err(WireError::Mismatch {
                field: "values",
                ..
            })
        ));
    }

    #[test]
    fn refuses_levels_out_of_order() {
        let got = levels_to_message(&[1, 1], &layout()).unwrap_err();
        assert_eq!(
            got.to_string(),
            "levels of entry 1 is 1, expected ascending levels"
        );
    }
}
