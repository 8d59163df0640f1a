//! A pictorial structure in space: solves for the joints of all views at once, using the maps of a network.
//!
//! The energy is the sum of the views' evidence at the projected joints, and of springs on the lengths of bones:
//!
//! `E(X) = sum_v sum_j u_v(j, P_v X_j) - mu sum_(i,j) rho((|X_i - X_j| - L_ij) / s_ij)`
//!
//! with `u = lambda ln(max(h, 0) + eps)` and `rho(z) = min(z^2 / 2, cap)`. The floor of `u` allows the other views to outvote a view that
//! does not see a joint. The bones form a tree, so the best choice among places of every joint is exact (Felzenszwalb & Huttenlocher 2005).
//! The places are first those suggested by pairs of views, then those of grids around the solution, from coarse to fine (Pavlakos et al.
//! 2017; Qiu et al. 2019).

use nalgebra::Point3;

use kernels::{Isa, LengthSpring, ScoredPoints};

use crate::space_places::Choices;
use crate::space_view::N;

/// The bones of the tree, as `[parent, child]` joints of `skeleton::PARSE14`, parents first. The hips are children of the neck.
pub const TREE: [[usize; 2]; N - 1] = [
    [12, 13],
    [12, 8],
    [8, 7],
    [7, 6],
    [12, 9],
    [9, 10],
    [10, 11],
    [12, 2],
    [2, 1],
    [1, 0],
    [12, 3],
    [3, 4],
    [4, 5],
];
const ROOT: usize = 12;

/// The expected length of a bone of [`TREE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoneLength {
    /// Mean length, in metres.
    pub mean: f64,
    /// Standard deviation of the length, in metres.
    pub sd: f64,
}

/// Settings of the solution in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpaceSettings {
    /// Weight of the springs (mu).
    pub springs: f64,
    /// Number of standard deviations at which the cost of a bone is capped; the cost is half of the square of this number.
    pub cap: f64,
    /// Cost of placing the right and the left joint of a pair at the same point.
    pub apart: f64,
    /// Minimum distance between the two joints of a pair at which the pair costs nothing, in metres.
    pub least_apart_m: f64,
    /// True if views name left and right as they appear in the picture, so that any view may have them swapped, independently of the
    /// others.
    pub as_seen: bool,
    /// Minimum amount by which a view must fit better with left and right swapped for the swap to be accepted.
    pub margin: f64,
    /// Limit for the first solution to fit a view: three quarters of its joints must score less than the view's own best positions by at
    /// most this amount. If it fits all views, no other solution is searched for.
    pub good_fit: f64,
    /// Limit above which a view contradicts all others: three quarters of the joints of their solution score less than the view's own best
    /// positions by at least this amount.
    pub most_misfit: f64,
    /// Maximum number of candidate places of a joint for the first solution.
    pub n_places: usize,
    /// Distance between the places of the coarsest grid, in metres.
    pub coarsest_m: f64,
    /// Distance between the places of the finest grid, in metres.
    pub finest_m: f64,
}

impl Default for SpaceSettings {
    fn default() -> Self {
        Self {
            springs: 1.0,
            cap: 8.0,
            apart: 3.0,
            least_apart_m: 0.1,
            as_seen: false,
            margin: 3.0,
            good_fit: 0.7,
            most_misfit: 1.0,
            n_places: 40,
            coarsest_m: 0.04,
            finest_m: 0.005,
        }
    }
}

/// The joints in space.
#[derive(Debug, Clone, PartialEq)]
pub struct SpacePose {
    /// The joints of `skeleton::PARSE14`, in metres in the world; `None` for a joint that fewer than two views show.
    pub joints: [Option<Point3<f64>>; N],
    /// Energy of the solution.
    pub energy: f64,
}

/// Stature assumed for unknown people, and its standard deviation, in metres. These values are our own choice; the deviation is large
/// enough to include children.
const STATURE: [f64; 2] = [1.65, 0.20];

/// Returns the bone lengths of [`TREE`] for a person with these joints, or for any person if `joints` is `None`.
///
/// The stature is the mean of the estimate from the joints and that for people in general, each weighted by its certainty.
pub fn lengths_of(joints: Option<&[Option<Point3<f64>>; N]>) -> [BoneLength; N - 1] {
    use skeleton::body::Kind::{
        Head, HipWidth, LowerArm, LowerLeg, ShoulderToNeck, Trunk, UpperArm, UpperLeg,
    };
    const KINDS: [skeleton::body::Kind; N - 1] = [
        Head,
        ShoulderToNeck,
        UpperArm,
        LowerArm,
        ShoulderToNeck,
        UpperArm,
        LowerArm,
        Trunk,
        UpperLeg,
        LowerLeg,
        Trunk,
        UpperLeg,
        LowerLeg,
    ];
    let [mean, sd] = STATURE;
    let said = joints.and_then(skeleton::body::stature);
    let [own, known] = [said.map_or(0.0, |said| said.sd.powi(-2)), sd.powi(-2)];
    let stature = (own * said.map_or(0.0, |said| said.metres) + known * mean) / (own + known);
    let unsure = (own + known).powf(-0.5) / stature;
    KINDS.map(|kind| {
        let proportion = kind.proportion();
        let length = proportion.length(stature);
        let half = if kind == Trunk {
            HipWidth.proportion().length(stature) / 2.0
        } else {
            0.0
        };
        let length = length.hypot(half);
        let sd = length * proportion.spread().hypot(unsure);
        BoneLength { mean: length, sd }
    })
}

/// Places to avoid: for each joint, the place of the joint on the other side. `None` for a joint without such a constraint.
pub(crate) type Occupied = [Option<Point3<f64>>; N];

/// Returns the cost of a joint for being close to the other joint of its pair.
pub(crate) fn cost(at: &Point3<f64>, other: &Point3<f64>, settings: &SpaceSettings) -> f64 {
    let share = (at - other).norm() / settings.least_apart_m;
    settings.apart * (1.0 - share).max(0.0)
}

/// Returns the best choice of one place for each joint, by passing messages from the leaves to the root and back.
///
/// * `choices`: the candidate places of every joint, possibly none.
/// * `occupied`: places that joints are kept away from.
/// * Returns `None` if no joint has a place.
pub(crate) fn best_on_tree(
    Choices { places, scores }: &Choices,
    (lengths, occupied): (&[BoneLength; N - 1], &Occupied),
    settings: &SpaceSettings,
) -> Option<SpacePose> {
    if places.iter().all(Vec::is_empty) {
        return None;
    }
    // A joint without places gets one place that costs nothing; its children are solved without it.
    let nowhere = [Point3::origin()];
    let is_there = |joint: usize| !places[joint].is_empty();
    let of = |joint: usize| -> &[Point3<f64>] {
        if is_there(joint) {
            &places[joint]
        } else {
            &nowhere
        }
    };
    let mut scores: [Vec<f64>; N] = core::array::from_fn(|joint| {
        let crowded =
            |at: &Point3<f64>| occupied[joint].map_or(0.0, |other| cost(at, &other, settings));
        let each = places[joint].iter().zip(&scores[joint]);
        let each = each.map(|(at, score)| score - crowded(at));
        if is_there(joint) {
            each.collect()
        } else {
            vec![0.0]
        }
    });
    let mut choices: [Vec<usize>; N - 1] = core::array::from_fn(|_| Vec::new());
    for (bone, [parent, child]) in TREE.into_iter().enumerate().rev() {
        let BoneLength { mean, sd } = lengths[bone];
        let springs = if is_there(parent) && is_there(child) {
            settings.springs
        } else {
            0.0
        };
        let spring = LengthSpring {
            mean,
            sd,
            weight: springs,
            cap: settings.cap,
        };
        let coordinates = |point: &Point3<f64>| [point.x, point.y, point.z];
        let ends = ScoredPoints::new(of(child).iter().map(coordinates), &scores[child]);
        let choice = ends.best(Isa::best(), of(parent).iter().map(coordinates), &spring);
        for (score, it) in scores[parent].iter_mut().zip(&choice) {
            *score += it.1;
        }
        choices[bone] = choice.into_iter().map(|choice| choice.0).collect();
    }
    let mut chosen = [0; N];
    let root = scores[ROOT].iter().enumerate();
    let (at, energy) = root.fold((0, f64::NEG_INFINITY), |best, (nth, it)| {
        if *it > best.1 { (nth, *it) } else { best }
    });
    chosen[ROOT] = at;
    for (bone, [parent, child]) in TREE.into_iter().enumerate() {
        chosen[child] = choices[bone][chosen[parent]];
    }
    Some(SpacePose {
        joints: core::array::from_fn(|joint| places[joint].get(chosen[joint]).copied()),
        energy,
    })
}

#[cfg(test)]
mod tests;
