//! World coordinates for a rig whose scale, vertical and floor are not known yet.

use geometry::Camera;
use nalgebra::{Matrix3, Point3, Rotation3, SymmetricEigen, UnitQuaternion, UnitVector3, Vector3};
use skeleton::body::{BONES, Joints, N_JOINTS, stature};
use statistics::Sorted;

use crate::align::{Similarity, aligned};

/// A foot counts as standing if the speed of its ankle is below this, in metres per second.
const STANDING_M_S: f64 = 0.25;
/// Conditions for a plane through standing feet to be the floor, in metres: the minimum distance between the feet, and their largest
/// deviation from the plane.
const FLOOR_M: [f64; 2] = [0.3, 0.06];
/// Largest angle between the normal of the floor and the direction from feet to head of standing people, in radians.
const FROM_BODIES: f64 = 0.5;
/// Largest bend of the legs of a person who stands, in radians.
const STRAIGHT: f64 = 0.35;
/// Height of the ankle above the floor as a fraction of the stature (Drillis & Contini 1966).
pub(crate) const ANKLE: f64 = 0.039;
/// Minimum number of skeletons, or of standing feet, from which anything is estimated.
pub(crate) const LEAST: usize = 5;
/// Indices of the ankle, knee and hip of each leg, and of the neck.
const LEGS: [[usize; 3]; 2] = [[0, 1, 2], [5, 4, 3]];
const NECK: usize = 12;

/// Source of the scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Standing height of the person in metres, from the lengths of the bones.
    Height(f64),
    /// Distance between two cameras, in metres.
    Distance(usize, usize, f64),
    /// The given rig, with its scale and its world.
    Rig,
}

/// Source of the vertical.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vertical {
    /// The plane in which the feet stand.
    Feet,
    /// The direction from feet to head of people who stand upright.
    Bodies,
    /// The mean direction from feet to head of all people, used if nobody stands with straight legs. It may be wrong by many degrees.
    Leaning,
    /// The given rig.
    Rig,
}

/// Skeletons by instant and joint.
pub type Skeletons = Vec<Vec<Option<Point3<f64>>>>;

/// Transformation from the world of a solution to metres with the floor at z = 0, with the source of the vertical.
pub(crate) struct World {
    pub(crate) to_metres: Similarity,
    pub(crate) up: Option<UnitVector3<f64>>,
    pub(crate) vertical: Vertical,
    /// Relative standard deviation of the scale, if the bones determine it.
    pub(crate) scale_sd: f64,
}

/// Returns the transformation; `None` if too few bones are seen to determine the scale.
pub(crate) fn world(
    cameras: &[Camera],
    given: (&[Camera], Option<UnitVector3<f64>>),
    scale: Scale,
    (times_s, skeletons): (&[f64], &Skeletons),
) -> Option<World> {
    let (factor, scale_sd) = match scale {
        Scale::Rig => {
            let (given, up) = given;
            return Some(World {
                to_metres: aligned(cameras, given, true)?,
                up,
                vertical: Vertical::Rig,
                scale_sd: 0.0,
            });
        }
        Scale::Distance(a, b, metres) => {
            let [a, b] = [a, b].map(|i| cameras[i].centre_in_world());
            (metres / (a - b).norm(), 0.0)
        }
        Scale::Height(metres) => of_height(skeletons, metres)?,
    };
    let scaled: Skeletons = skeletons
        .iter()
        .map(|skeleton| skeleton.iter().map(|joint| joint.map(|value| value * factor)).collect())
        .collect();
    let (up, vertical) = vertical(times_s, &scaled)?;
    let to_z = turn_to_z(up);
    let turned = |point: &Point3<f64>| to_z * point;
    let feet: Vec<Point3<f64>> = standing(times_s, &scaled, &up).iter().map(turned).collect();
    let all = scaled.iter().flatten().flatten();
    let turned: Vec<Point3<f64>> = all.map(turned).collect();
    let middle = |axis: usize| {
        Sorted::new(turned.iter().map(|turned| turned[axis]).collect::<Vec<_>>()).upper_median()
    };
    let ankle = ANKLE * stature_of(&scaled).map_or(1.7, |stature| stature.0);
    let floor = match Sorted::new(feet.iter().map(|foot| foot.z).collect::<Vec<_>>()).upper_median()
    {
        Some(height) if feet.len() >= LEAST => height - ankle,
        _ => turned.iter().map(|turned| turned.z).fold(f64::INFINITY, f64::min) - ankle,
    };
    let to_metres = Similarity {
        rotation: to_z,
        scale: factor,
        translation: Vector3::new(-middle(0)?, -middle(1)?, -floor),
    };
    Some(World {
        to_metres,
        up: Some(Vector3::z_axis()),
        vertical,
        scale_sd,
    })
}

/// Returns the smallest rotation that takes a direction to z.
fn turn_to_z(up: UnitVector3<f64>) -> UnitQuaternion<f64> {
    let half = UnitQuaternion::rotation_between(&up, &Vector3::z());
    half.unwrap_or_else(|| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(
            &Vector3::x_axis(),
            core::f64::consts::PI,
        ))
    })
}

fn joints(skeleton: &[Option<Point3<f64>>]) -> Joints {
    let mut joints: Joints = [None; N_JOINTS];
    for (to, from) in joints.iter_mut().zip(skeleton) {
        *to = *from;
    }
    joints
}

/// Returns the median stature over all skeletons, and its standard deviation, in metres.
pub(crate) fn stature_of(skeletons: &Skeletons) -> Option<(f64, f64)> {
    let mut each: Vec<[f64; 2]> = skeletons
        .iter()
        .filter_map(|skeleton| stature(&joints(skeleton)))
        .map(|stature| [stature.metres, stature.sd])
        .collect();
    if each.len() < LEAST {
        return None;
    }
    each.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let [metres, sd] = each[each.len() / 2];
    Some((metres, sd))
}

/// Returns the number of metres per unit if the person is `metres` tall, and its relative standard deviation.
fn of_height(skeletons: &Skeletons, metres: f64) -> Option<(f64, f64)> {
    // The proportions of the body depend slightly on the stature, so the factor is found by bisection.
    let tall = |factor: f64| {
        let scaled = skeletons.iter();
        let scaled: Skeletons = scaled
            .map(|scaled| scaled.iter().map(|joint| joint.map(|value| value * factor)).collect())
            .collect();
        stature_of(&scaled)
    };
    let (first, _) = tall(1.0)?;
    let [mut low, mut high] = [0.3, 3.0].map(|value| value * metres / first);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if tall(middle)?.0 < metres {
            low = middle;
        } else {
            high = middle;
        }
    }
    let factor = f64::midpoint(low, high);
    let (_, sd) = tall(factor)?;
    Some((factor, sd / metres))
}

/// Returns the position of the lower ankle at every instant at which this foot stands, in metres.
///
/// * `up`: approximate up direction.
pub(crate) fn standing(
    times_s: &[f64],
    skeletons: &Skeletons,
    up: &UnitVector3<f64>,
) -> Vec<Point3<f64>> {
    let mut feet = Vec::new();
    for nth in 1..skeletons.len() {
        let passed = times_s[nth] - times_s[nth - 1];
        if passed > 0.5 || passed <= 0.0 {
            continue;
        }
        let [right, left] = LEGS.map(|leg| skeletons[nth][leg[0]]);
        let (Some(right), Some(left)) = (right, left) else {
            continue;
        };
        let is_right = (right - left).dot(up) < 0.0;
        let (at, ankle) = if is_right {
            (right, LEGS[0][0])
        } else {
            (left, LEGS[1][0])
        };
        let before = skeletons[nth - 1][ankle];
        if before.is_some_and(|before| (at - before).norm() < STANDING_M_S * passed) {
            feet.push(at);
        }
    }
    feet
}

/// Returns the up direction, and its source.
pub(crate) fn vertical(
    times_s: &[f64],
    skeletons: &Skeletons,
) -> Option<(UnitVector3<f64>, Vertical)> {
    let upright: Vec<Vector3<f64>> =
        skeletons.iter().filter_map(|skeleton| body(skeleton, STRAIGHT)).collect();
    let all: Vec<Vector3<f64>> = skeletons
        .iter()
        .filter_map(|skeleton| body(skeleton, core::f64::consts::PI))
        .collect();
    let (bodies, source) = if upright.len() >= LEAST {
        (middle(&upright)?, Vertical::Bodies)
    } else {
        (middle(&all)?, Vertical::Leaning)
    };
    let feet = standing(times_s, skeletons, &bodies);
    if let Some(normal) = floor(&feet) {
        let normal = if normal.dot(&bodies) < 0.0 {
            -normal
        } else {
            normal
        };
        if normal.angle(&bodies) < FROM_BODIES {
            return Some((normal, Vertical::Feet));
        }
    }
    Some((bodies, source))
}

/// Returns the normal of the plane in which the feet stand.
fn floor(feet: &[Point3<f64>]) -> Option<UnitVector3<f64>> {
    let mut kept: Vec<Point3<f64>> = feet.to_vec();
    let mut normal = None;
    for _ in 0..3 {
        if kept.len() < 4 * LEAST {
            return None;
        }
        let n = kept.len() as f64;
        let middle = kept.iter().map(|foot| foot.coords).sum::<Vector3<f64>>() / n;
        let spread: Matrix3<f64> = kept
            .iter()
            .map(|foot| (foot.coords - middle) * (foot.coords - middle).transpose() / n)
            .sum();
        let eigen = SymmetricEigen::new(spread);
        let mut sizes: Vec<f64> =
            eigen.eigenvalues.iter().map(|eigenvalue| eigenvalue.max(0.0).sqrt()).collect();
        sizes.sort_by(f64::total_cmp);
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let is_floor = sizes[1] > FLOOR_M[0] && sizes[0] < FLOOR_M[1];
        normal = is_floor.then(|| UnitVector3::new_normalize(axis));
        let limit = (2.5 * sizes[0]).max(0.01);
        kept.retain(|foot| (foot.coords - middle).dot(&axis).abs() < limit);
    }
    normal
}

/// Returns the vector from the midpoint of the ankles to the neck, for a person who stands on a straight leg with a straight trunk.
fn body(skeleton: &[Option<Point3<f64>>], most: f64) -> Option<Vector3<f64>> {
    let neck = skeleton[NECK]?.coords;
    let (mut ankles, mut hips) = (Vector3::zeros(), Vector3::zeros());
    let mut bend = f64::INFINITY;
    for [ankle, knee, hip] in LEGS {
        let [ankle, knee, hip] = [skeleton[ankle]?, skeleton[knee]?, skeleton[hip]?];
        bend = bend.min((knee - ankle).angle(&(hip - knee)));
        ankles += 0.5 * ankle.coords;
        hips += 0.5 * hip.coords;
    }
    let way = neck - ankles;
    let is_straight = bend <= most && (hips - ankles).angle(&(neck - hips)) <= most;
    (is_straight && way.norm() > 1e-9).then(|| way / way.norm())
}

/// Returns the direction whose coordinates are the medians along each axis.
fn middle(all: &[Vector3<f64>]) -> Option<UnitVector3<f64>> {
    if all.len() < LEAST {
        return None;
    }
    let axis = |axis: usize| {
        Sorted::new(all.iter().map(|direction| direction[axis]).collect::<Vec<_>>()).upper_median()
    };
    UnitVector3::try_new(Vector3::new(axis(0)?, axis(1)?, axis(2)?), 1e-9)
}

/// Returns the change of bone lengths over time: the median, over all bones, of the median deviation from the bone's median length, as a
/// fraction.
pub(crate) fn bone_spread(skeletons: &Skeletons) -> Option<f64> {
    let mut each = Vec::new();
    for bone in BONES.iter().filter(|bone| bone.from[0] == bone.from[1]) {
        let lengths: Vec<f64> =
            skeletons.iter().filter_map(|skeleton| bone.length(&joints(skeleton))).collect();
        if lengths.len() < 2 * LEAST {
            continue;
        }
        let lengths = Sorted::new(lengths);
        let length = lengths.upper_median()?;
        let away: Vec<f64> =
            lengths.values().iter().map(|value| (value / length - 1.0).abs()).collect();
        each.push(1.4826 * Sorted::new(away).upper_median()?);
    }
    Sorted::new(each).upper_median()
}
