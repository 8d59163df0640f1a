//! Draws the 3D pose on the picture of a view: limbs, and around every joint the ellipse of two standard deviations.

use core::f64::consts::TAU;

use footage::{CENTRE, Canvas, Limb, Side, draw_limbs, line_width};

use crate::{Seen, Trial, ViewCamera};

/// Half-axis of the ellipses, in standard deviations.
pub const DEVIATIONS: f64 = 2.0;
/// Number of points of an ellipse.
const N_POINTS: usize = 40;

/// Draws a frame on the picture of a view, with all people. If there are several people, each is labelled with the person's number.
pub fn draw(canvas: &mut Canvas, trials: &[Trial], slot: usize, view: &ViewCamera) {
    for trial in trials {
        let at = person(canvas, trial, slot, view);
        if let Some([x, y]) = at.filter(|_| trials.len() > 1) {
            canvas.label([x, y], &trial.id().to_string(), CENTRE);
        }
    }
    let Some(trial) = best(trials, slot) else {
        return;
    };
    let status = &trial.slots[slot].status;
    let time = trial.time_s(slot).map_or(String::new(), |time_s| format!(" {time_s:.3} s"));
    let what = match &**status {
        "ok" => "",
        "" => " no result",
        other => other,
    };
    let text = format!("{} {}{time} {what}", view.name, trial.frame(slot));
    canvas.label([2.0, 2.0], text.trim_end(), CENTRE);
}

/// Returns the trial whose status is used for the whole frame: one with a person in this frame, if there is one.
fn best(trials: &[Trial], slot: usize) -> Option<&Trial> {
    let is_there = |trial: &&Trial| trial.slots[slot].points.iter().any(Result::is_ok);
    trials.iter().find(is_there).or(trials.first())
}

/// Draws a person. Returns the upper left corner of the visible part.
fn person(canvas: &mut Canvas, trial: &Trial, slot: usize, view: &ViewCamera) -> Option<[f64; 2]> {
    let seen: Vec<Option<Seen>> = trial
        .points(slot)
        .map(|point| point.and_then(|point| view.see(point)))
        .collect();
    let names: Vec<&str> = trial.names().collect();
    let n_joints = trial.joints.joints.len();
    let width = line_width(canvas.size());
    for (name, seen) in names.iter().zip(&seen).take(n_joints) {
        if let Some(seen) = seen {
            ellipse(canvas, seen, width / 2.0, side_of(name));
        }
    }
    let places: Vec<[f64; 2]> =
        seen.iter().map(|point| point.map_or([f64::NAN; 2], |seen| seen.at)).collect();
    draw_limbs(canvas, &places, &limbs(trial));
    for (name, at) in names.iter().zip(&places).skip(n_joints) {
        canvas.disc(*at, width, side_of(name).colour());
    }
    let places = seen.iter().flatten().map(|seen| seen.at);
    places.reduce(|corner, at| [corner[0].min(at[0]), corner[1].min(at[1])])
}

fn ellipse(canvas: &mut Canvas, seen: &Seen, width: f64, side: Side) {
    let Some([xx, xy, yy]) = seen.covariance else {
        return;
    };
    // An ellipse that is larger than the picture is of no use, and takes long to draw.
    let size = canvas.size();
    let longest = (size.width + size.height) as f64;
    if (DEVIATIONS * (xx + yy).sqrt()).total_cmp(&longest).is_gt() {
        return;
    }
    // The lower triangle of the square root of the covariance.
    let a = xx.max(0.0).sqrt();
    let b = if a > 0.0 { xy / a } else { 0.0 };
    let c = (yy - b * b).max(0.0).sqrt();
    let points: Vec<[f64; 2]> = (0..=N_POINTS)
        .map(|nth| {
            let (sin, cos) = (TAU * nth as f64 / N_POINTS as f64).sin_cos();
            [
                seen.at[0] + DEVIATIONS * a * cos,
                seen.at[1] + DEVIATIONS * (b * cos + c * sin),
            ]
        })
        .collect();
    canvas.polyline(&points, width, side.colour());
}

/// Returns the side of the body of a point, by its name.
pub(crate) fn side_of(name: &str) -> Side {
    let is = |side: &str, of: char| {
        let own = |part: &str| {
            let mut rest = part.chars();
            rest.next() == Some(of) && rest.next().is_some_and(char::is_uppercase)
        };
        name.starts_with(side)
            || ["upper", "lower"]
                .iter()
                .any(|prefix| name.strip_prefix(prefix).is_some_and(own))
    };
    if is("right", 'R') {
        Side::Right
    } else if is("left", 'L') {
        Side::Left
    } else {
        Side::Centre
    }
}

fn limbs(trial: &Trial) -> Vec<Limb> {
    let side = |joint: usize| side_of(trial.joints.joints[joint].name);
    let limbs = trial.joints.limbs.iter();
    limbs
        .map(|&(from, to)| Limb {
            from,
            to,
            side: match side(from) {
                Side::Centre => side(to),
                own => own,
            },
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use footage::Size;

    use super::*;
    use crate::testing::{camera, walker};

    fn drawn(trial: &Trial, slot: usize) -> Vec<u8> {
        let mut canvas = Canvas::new(Size::new(320, 240), [0; 3]);
        draw(&mut canvas, core::slice::from_ref(trial), slot, &camera());
        canvas.rgb().to_vec()
    }

    #[test]
    fn the_pose_is_drawn_and_a_gap_is_named() {
        let mut trial = walker(2);
        let with = drawn(&trial, 0);
        trial.slots[0] = crate::Slot::default();
        let without = drawn(&trial, 0);
        let lit = |rgb: &[u8]| rgb.iter().filter(|rgb| **rgb > 60).count();
        assert!(lit(&with) > lit(&without) + 500 && lit(&without) > 100);
    }

    #[test]
    fn everybody_is_drawn_with_the_status_of_the_people_found() {
        let mut pair = [walker(2), walker(2)];
        pair[1].ids = vec![7];
        for point in pair[1].slots[0].points.iter_mut().flatten() {
            point.in_world.x += 0.6;
        }
        pair[0].slots[1] = crate::Slot::default();
        let lit = |trials: &[Trial], slot: usize| {
            let mut canvas = Canvas::new(Size::new(320, 240), [0; 3]);
            draw(&mut canvas, trials, slot, &camera());
            canvas.rgb().iter().filter(|rgb| **rgb > 60).count()
        };
        assert!(lit(&pair, 0) > lit(&pair[..1], 0) + 500);
        assert!(lit(&pair, 1) > lit(&pair[..1], 1) + 500);
        assert_eq!(best(&pair, 1).map(Trial::id), Some(7));
    }

    #[test]
    fn an_unknown_covariance_has_no_ellipse_and_an_infinite_one_is_tolerated() {
        let mut trial = walker(1);
        let with = drawn(&trial, 0);
        for point in trial.slots[0].points.iter_mut().flatten() {
            point.covariance = [f64::NAN; 6];
        }
        assert_ne!(drawn(&trial, 0), with);
        for point in trial.slots[0].points.iter_mut().flatten() {
            point.covariance = [1e300, 0.0, 0.0, 1e300, 0.0, 1e300];
        }
        drawn(&trial, 0);
    }

    #[test]
    fn sides_are_recognised_from_the_joint_names_of_all_sets() {
        for (name, side) in [
            ("right knee", Side::Right),
            ("left heel", Side::Left),
            ("upperLArmProximal", Side::Left),
            ("lowerRLegDistal", Side::Right),
            ("torsoProximal", Side::Centre),
            ("neck", Side::Centre),
        ] {
            assert_eq!(side_of(name), side, "{name}");
        }
    }
}
