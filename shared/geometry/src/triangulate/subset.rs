//! Selection of the views to use: all views, or the largest subset found that agrees.

use super::{
    Settings, TriangulateError, linear,
    refine::{self, Fit},
    views::{Subset, Views},
};

/// Fits all views, then leaves out one after another until the rest agree.
pub(super) fn search(
    views: &Views<'_>,
    all: Subset,
    settings: &Settings,
) -> Result<(Subset, Fit), TriangulateError> {
    let needed = settings.min_views.max(2);
    let mut used = all;
    let mut fitted = fit(views, used, settings);
    let Some(limit_px) = settings.max_reprojection_px else {
        return fitted.map(|fit| (used, fit));
    };
    loop {
        let worst_px = match fitted {
            Ok(ref good) if good.worst_px <= limit_px => return fitted.map(|fit| (used, fit)),
            Ok(ref bad) => bad.worst_px,
            Err(_) => f64::INFINITY,
        };
        let smaller =
            (used.count() > needed).then(|| leave_one_out(views, used, settings)).flatten();
        let Some(smaller) = smaller else {
            fitted?;
            return Err(TriangulateError::Inconsistent {
                needed,
                residual_px: worst_px,
                limit_px,
            });
        };
        (used, fitted) = (smaller.0, Ok(smaller.1));
    }
}

/// Returns the fit with the smallest worst error among the fits that leave out one view; the first, if several are equal.
fn leave_one_out(views: &Views<'_>, used: Subset, settings: &Settings) -> Option<(Subset, Fit)> {
    let mut best: Option<(Subset, Fit)> = None;
    for view in used.iter() {
        let rest = used.without(view);
        if let Ok(candidate) = fit(views, rest, settings)
            && best.as_ref().is_none_or(|(_, fit)| candidate.worst_px < fit.worst_px)
        {
            best = Some((rest, candidate));
        }
    }
    best
}

fn fit(views: &Views<'_>, used: Subset, settings: &Settings) -> Result<Fit, TriangulateError> {
    let start = linear::triangulate(views, used, settings.min_angle)?;
    refine::refine(views, used, start, settings.loss_px)
}
