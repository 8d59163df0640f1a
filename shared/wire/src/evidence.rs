//! Response maps: the header that describes an array sent without copying.

use fmp::{Bound, Bounds, Layout, Region, Responses, Scope, ScopeError};
use messages::{EvidenceHeader, MAX_LEVELS, Stamp, Status, Timing};

use crate::WireError;
use crate::error::{count, equal, index};

/// Received evidence: the responses, which remain in shared memory, and the bounds of their levels.
#[derive(Debug, Clone)]
pub struct EvidenceView<'a> {
    responses: Responses<'a>,
    bounds: Bounds,
}

impl EvidenceView<'_> {
    /// Returns the responses with their bounds.
    pub fn responses(&self) -> Responses<'_> {
        self.responses.with_bounds(&self.bounds)
    }
}

/// Writes the scope of the responses, the valid levels and their bounds. The caller fills in stamp and
/// timing.
///
/// * `levels`: the valid levels, ascending.
/// * `bounds`: bounds of the same responses. An invalid bound is sent as unknown.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_LEVELS`] levels, if they are not ascending levels of
/// `scope`, or if the bounds belong to another layout.
pub fn evidence_to_message(
    levels: &[u16],
    bounds: &Bounds,
    scope: &Scope,
    layout: &Layout,
) -> Result<EvidenceHeader, WireError> {
    let mut message = EvidenceHeader {
        stamp: Stamp::default(),
        timing: Timing::default(),
        width: layout.image_size[0] as u32,
        height: layout.image_size[1] as u32,
        status: Status::OK,
        n_levels: count("n_levels", levels.len(), MAX_LEVELS)? as u32,
        x: scope.region().x,
        y: scope.region().y,
        scope_levels: [scope.levels().start, scope.levels().end],
        ..EvidenceHeader::default()
    };
    ascending(levels, scope)?;
    equal("bounds", bounds.n_levels(), layout.levels.len())?;
    message.levels[..levels.len()].copy_from_slice(levels);
    for (entry, &level) in levels.iter().enumerate() {
        let bound = bounds.levels()[usize::from(level)];
        let bound = if refusal(entry, bound).is_none() {
            bound
        } else {
            Bound::UNKNOWN
        };
        (message.best[entry], message.size[entry]) = (bound.best, bound.size);
    }
    Ok(message)
}

/// Reads the values sent with `message` as responses of `layout`, without copying them.
///
/// # Errors
///
/// Returns a [`WireError`] in these cases:
///
/// * The image size is not that of `layout`, or the scope exceeds the layout.
/// * There are fewer values than the scope has cells, or the levels are not ascending levels of the scope.
/// * A bound is invalid: it is not a number or minus infinity, or its size is negative or infinite.
pub fn evidence_from_message<'a>(
    message: &'a EvidenceHeader,
    values: &'a [f32],
    layout: &'a Layout,
) -> Result<EvidenceView<'a>, WireError> {
    equal("width", message.width as usize, layout.image_size[0])?;
    equal("height", message.height as usize, layout.image_size[1])?;
    let scope = scope_from_message(message, layout)?;
    if values.len() < layout.n_values(&scope) {
        return Err(WireError::Mismatch {
            field: "values",
            got: values.len(),
            expected: layout.n_values(&scope),
        });
    }
    let n_levels = count("n_levels", message.n_levels as usize, MAX_LEVELS)?;
    let levels = &message.levels[..n_levels];
    ascending(levels, &scope)?;
    let mut bounds = vec![Bound::UNKNOWN; layout.levels.len()];
    for (entry, &level) in levels.iter().enumerate() {
        let bound = Bound {
            best: message.best[entry],
            size: message.size[entry],
        };
        match refusal(entry, bound) {
            Some(error) => return Err(error),
            None => bounds[usize::from(level)] = bound,
        }
    }
    Ok(EvidenceView {
        responses: Responses::within(layout, values, levels, scope),
        bounds: Bounds::new(bounds),
    })
}

/// Returns the error of an invalid bound.
fn refusal(entry: usize, bound: Bound) -> Option<WireError> {
    let refused = |field, got: f32, expected| {
        Some(WireError::Value {
            field,
            entry,
            got: f64::from(got),
            expected,
        })
    };
    if bound.best.is_nan() || bound.best == f32::NEG_INFINITY {
        refused("best", bound.best, "a score")
    } else if !(bound.size.is_finite() && bound.size >= 0.0) {
        refused("size", bound.size, "finite and not negative")
    } else {
        None
    }
}

fn scope_from_message(message: &EvidenceHeader, layout: &Layout) -> Result<Scope, WireError> {
    let [first, end] = message.scope_levels;
    let region = Region {
        x: message.x,
        y: message.y,
    };
    Scope::new(layout, first..end, region).map_err(|error| match error {
        ScopeError::Levels { end, n_levels, .. } => WireError::Mismatch {
            field: "scope_levels",
            got: usize::from(end),
            expected: n_levels,
        },
        ScopeError::Region { end, side, .. } => WireError::Mismatch {
            field: "region",
            got: end as usize,
            expected: side,
        },
    })
}

fn ascending(levels: &[u16], scope: &Scope) -> Result<(), WireError> {
    for (entry, &level) in levels.iter().enumerate() {
        index(
            "levels",
            entry,
            usize::from(level),
            usize::from(scope.levels().end),
        )?;
        if level < scope.levels().start || entry > 0 && levels[entry - 1] >= level {
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

    fn unknown() -> Bounds {
        Bounds::new(vec![Bound::UNKNOWN; layout().levels.len()])
    }

    /// Returns any scope of the layout, given as fractions of its levels, columns and rows.
    fn scope() -> impl Strategy<Value = Scope> {
        let layout = layout();
        let range = |n: usize| {
            (0..n, 1..=n).prop_map(move |(begin, n_more)| [begin, (begin + n_more).min(n)])
        };
        let [width, height] = layout.image_size;
        let ranges = (range(layout.levels.len()), range(width), range(height));
        ranges.prop_map(move |(levels, x, y)| {
            let [x, y] = [x, y].map(|ends| ends.map(|value| value as u32));
            let levels = levels.map(|level| level as u16);
            Scope::new(&layout, levels[0]..levels[1], Region { x, y }).unwrap()
        })
    }

    proptest! {
        #[test]
        fn levels_bounds_and_scope_survive_a_round_trip(
            scope in scope(),
            mask in prop::collection::vec(any::<bool>(), 96),
            known in prop::collection::vec((-1e6..1e6_f32, 0.0..1e6_f32, any::<bool>()), 96),
        ) {
            let layout = layout();
            let levels: Vec<u16> = scope.levels().filter(|&level| mask[usize::from(level)]).collect();
            let bound = |level: u16| match known[usize::from(level)] {
                (best, size, true) if levels.contains(&level) => Bound { best, size },
                _ => Bound::UNKNOWN,
            };
            let bounds = Bounds::new((0..layout.levels.len() as u16).map(bound).collect());
            let message = evidence_to_message(&levels, &bounds, &scope, &layout).unwrap();
            let values = vec![0.0; layout.n_values(&scope)];
            let back = evidence_from_message(&message, &values, &layout).unwrap();
            let back = back.responses();
            prop_assert_eq!(back.levels(), levels);
            prop_assert_eq!(back.bounds(), Some(&bounds));
            prop_assert_eq!(back.scope(), &scope);
            let too_few = &values[1..];
            let got = evidence_from_message(&message, too_few, &layout);
            let is_refused = matches!(got, Err(WireError::Mismatch { field: "values", .. }));
            prop_assert!(is_refused);
        }

        #[test]
        fn any_message_is_refused_or_readable(
            n_levels in any::<u32>(),
            small in 0_u32..4,
            levels in prop::collection::vec(0_u16..20, MAX_LEVELS),
            ranges in prop::collection::vec(0_u32..90, 6),
            bounds in prop::collection::vec((any::<u32>(), any::<u32>()), MAX_LEVELS),
        ) {
            let layout = layout();
            let values = vec![0.0; layout.n_responses()];
            let whole = Scope::whole(&layout);
            let mut message = evidence_to_message(&[], &unknown(), &whole, &layout).unwrap();
            message.levels.copy_from_slice(&levels);
            message.best = std::array::from_fn(|i| f32::from_bits(bounds[i].0));
            message.size = std::array::from_fn(|i| f32::from_bits(bounds[i].1));
            for (n, any_scope) in [(n_levels, false), (small, false), (small, true)] {
                message.n_levels = n;
                if any_scope {
                    message.x = [ranges[0], ranges[1]];
                    message.y = [ranges[2], ranges[3]];
                    message.scope_levels = [ranges[4], ranges[5]].map(|level| level as u16 / 4);
                }
                if let Ok(evidence) = evidence_from_message(&message, &values, &layout) {
                    let evidence = evidence.responses();
                    for bound in evidence.bounds().unwrap().levels() {
                        prop_assert!(bound.best > f32::NEG_INFINITY && bound.size.is_finite());
                    }
                    for &level in evidence.levels() {
                        prop_assert!(!evidence.map(usize::from(level), 0).is_empty());
                    }
                }
            }
        }
    }

    fn refused(change: impl FnOnce(&mut EvidenceHeader)) -> String {
        let layout = layout();
        let values = vec![0.0; layout.n_responses()];
        let whole = Scope::whole(&layout);
        let mut message = evidence_to_message(&[1], &unknown(), &whole, &layout).unwrap();
        change(&mut message);
        let got = evidence_from_message(&message, &values, &layout);
        got.unwrap_err().to_string()
    }

    #[test]
    fn refuses_levels_out_of_order() {
        let layout = layout();
        let whole = Scope::whole(&layout);
        let got = evidence_to_message(&[1, 1], &unknown(), &whole, &layout).unwrap_err();
        assert_eq!(
            got.to_string(),
            "levels of entry 1 is 1, expected ascending levels"
        );
    }

    #[test]
    fn refuses_levels_outside_the_scope() {
        let before = refused(|header| header.scope_levels[0] = 2);
        assert_eq!(before, "levels of entry 0 is 1, expected ascending levels");
        let after = refused(|header| header.scope_levels[1] = 1);
        assert_eq!(after, "levels of entry 0 is 1, but the limit is 1");
    }

    #[test]
    fn refuses_a_scope_beyond_the_image() {
        assert_eq!(
            refused(|header| header.x[1] = 81),
            "region is 81, expected 80"
        );
        let n_levels = layout().levels.len();
        let want = format!("scope_levels is 999, expected {n_levels}");
        assert_eq!(refused(|header| header.scope_levels[1] = 999), want);
    }

    #[test]
    fn refuses_bounds_of_another_layout() {
        let (layout, none) = (layout(), Bounds::new(Vec::new()));
        let got = evidence_to_message(&[0], &none, &Scope::whole(&layout), &layout).unwrap_err();
        assert!(matches!(
            got,
            WireError::Mismatch {
                field: "bounds",
                ..
            }
        ));
    }

    #[test]
    fn refuses_invalid_bounds() {
        let error_of = |best: f32, size: f32| {
            refused(|header| (header.best[0], header.size[0]) = (best, size))
        };
        assert_eq!(
            error_of(f32::NAN, 1.0),
            "best of entry 0 is NaN, expected a score"
        );
        assert!(error_of(f32::NEG_INFINITY, 1.0).contains("best"));
        for size in [f32::NAN, f32::INFINITY, -1.0] {
            assert!(error_of(0.0, size).contains("size"));
        }
    }

    #[test]
    fn an_invalid_bound_is_sent_as_unknown() {
        let layout = layout();
        for best in [f32::NAN, f32::NEG_INFINITY] {
            let bounds = Bounds::new(vec![Bound { best, size: 1.0 }; layout.levels.len()]);
            let whole = Scope::whole(&layout);
            let message = evidence_to_message(&[0], &bounds, &whole, &layout).unwrap();
            assert_eq!((message.best[0], message.size[0]), (f32::INFINITY, 0.0));
        }
    }
}
