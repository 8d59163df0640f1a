//! Properties of the single-view pose, as values of a network's second input.

use fmp::{Layout, LocalScore, Model, Pose, Springs};

use crate::Tile;

/// Version of the layout of [`evidence`]; a network declares the version that it was trained with.
pub const EVIDENCE_VERSION: u32 = 1;

/// Maximum number of types of a part in the layout.
pub const N_TYPES: usize = 6;

/// Values of every part, in this order, followed by the types.
///
/// * `response`, `contrast`, `margin`: see [`LocalScore`].
/// * `spring`: score of the spring to the parent, at most slightly above 0; 0 for the root.
/// * `pair_bias`: score of the pair of types of part and parent; 0 for the root.
/// * `x`, `y`: position of the part's centre relative to the tile's centre, in heights of the tile.
/// * `from_mirror`: distance to the corresponding part on the other side of the body, in box sides; 0 if the part is its own mirror.
/// * `from_second`: distance to the same part of the second candidate, in box sides, at most [`FAR`].
///   Without a second candidate, it is [`FAR`].
/// * `inside`: distance to the nearest border of the frame, in box sides, limited to [`FAR`]; negative outside the frame.
/// * `type_1` to `type_6`: 1 for the part's type, else 0.
pub const PART_NUMBERS: [&str; 10] = [
    "response",
    "contrast",
    "margin",
    "spring",
    "pair_bias",
    "x",
    "y",
    "from_mirror",
    "from_second",
    "inside",
];

/// Values of the pose as a whole, which follow the values of the parts.
///
/// * `score`: score of the pose.
/// * `lead`: the score minus the score of the second candidate, at most [`FAR`]. Without a second candidate, it is
///   [`FAR`].
/// * `candidates`: number of candidates, up to 8, divided by 8.
/// * `log_box_side`: natural logarithm of the root's box side in pixels of the frame.
/// * `tile_height`: the tile's height divided by the frame's.
/// * `aspect`: width of the box of all parts divided by its height.
/// * `responses`, `springs`: sums over the parts.
pub const POSE_NUMBERS: [&str; 8] = [
    "score",
    "lead",
    "candidates",
    "log_box_side",
    "tile_height",
    "aspect",
    "responses",
    "springs",
];

/// Largest absolute value of distances, in box sides, and of differences of scores.
pub const FAR: f32 = 10.0;

/// Used instead of minus infinity for a pair of types that the model rules out.
const IMPOSSIBLE: f64 = -100.0;

const PER_PART: usize = PART_NUMBERS.len() + N_TYPES;
const MOST_CANDIDATES: usize = 8;

/// Number of values for a model with the given number of parts: 424 for 26.
pub fn n_evidence(n_parts: usize) -> usize {
    n_parts * PER_PART + POSE_NUMBERS.len()
}

/// Name of the value at an index, for example `part 3 spring`; parts and types are counted from 1.
///
/// * Returns `None` if the index is not below [`n_evidence`].
pub fn evidence_name(index: usize, n_parts: usize) -> Option<String> {
    let (part, number) = (index / PER_PART, index % PER_PART);
    if part < n_parts {
        let name = match PART_NUMBERS.get(number) {
            Some(name) => (*name).to_owned(),
            None => format!("type_{}", number - PART_NUMBERS.len() + 1),
        };
        return Some(format!("part {} {name}", part + 1));
    }
    let name = POSE_NUMBERS.get(index - n_parts * PER_PART)?;
    Some((*name).to_owned())
}

/// Reason why the evidence could not be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EvidenceError {
    /// There is no candidate.
    #[error("there is no pose")]
    NoPose,
    /// A part has more types than the layout allows.
    #[error("part {part} has {got} types, but the evidence allows at most {N_TYPES}")]
    Types {
        /// Number of the part, from 1.
        part: usize,
        /// Number of the part's types.
        got: usize,
    },
    /// The number of local scores differs from the number of parts of the pose.
    #[error("there are {got} local scores for {expected} parts")]
    Scores {
        /// Number of scores given.
        got: usize,
        /// Number of parts of the pose.
        expected: usize,
    },
}

/// Writes the properties of the best candidate: [`n_evidence`] values without scaling. The values are [`PART_NUMBERS`] and the types for
/// every part, then [`POSE_NUMBERS`]. The network has to scale them.
///
/// * `candidates`: candidates of the frame, best first; the first is the pose.
/// * `scores`: local scores of the pose; see [`fmp::local_scores`].
/// * `tile`: tile of the pose.
/// * `out`: overwritten.
///
/// # Errors
///
/// Fails with [`EvidenceError`].
pub fn evidence(
    (model, layout): (&Model, &Layout),
    candidates: &[Pose],
    scores: &[LocalScore],
    tile: &Tile,
    out: &mut Vec<f32>,
) -> Result<(), EvidenceError> {
    let pose = candidates.first().ok_or(EvidenceError::NoPose)?;
    let n_parts = pose.parts.len();
    if scores.len() != n_parts {
        return Err(EvidenceError::Scores {
            got: scores.len(),
            expected: n_parts,
        });
    }
    let centres = pose.centres(model, layout);
    let second = candidates.get(1).map(|candidate| candidate.centres(model, layout));
    let mirror = model.spec().mirror.as_deref();
    let [width, height] = layout.image_size.map(|image_size| image_size as f64 - 1.0);
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let (mut responses, mut springs) = (0.0, 0.0);
    out.clear();
    out.reserve(n_evidence(n_parts));
    for (part, score) in scores.iter().enumerate() {
        let n_types = model.n_types(part);
        if n_types > N_TYPES {
            let part = part + 1;
            return Err(EvidenceError::Types { part, got: n_types });
        }
        let side = box_side(model, layout, pose, part);
        let sides = |px: f64| (px / side).clamp(-f64::from(FAR), f64::from(FAR)) as f32;
        let centre = centres[part];
        let [x, y] = tile.place(centre).map(|value| value as f32);
        let [spring, pair_bias] = edge(model, pose, part);
        let from_mirror =
            mirror.map_or(0.0, |mirror| sides(distance(centre, centres[mirror[part]])));
        let from_second =
            second.as_ref().map_or(FAR, |second| sides(distance(centre, second[part])));
        let to_border = [centre[0], centre[1], width - centre[0], height - centre[1]];
        let inside = sides(to_border.into_iter().fold(f64::INFINITY, f64::min));
        out.extend([score.response, score.contrast, score.margin]);
        out.extend([spring, pair_bias, x, y, from_mirror, from_second, inside]);
        let own = usize::from(pose.parts[part].mixture);
        out.extend((0..N_TYPES).map(|mixture| f32::from(u8::from(mixture == own))));
        responses += score.response;
        springs += spring;
    }
    let [x1, y1, x2, y2] = pose.bounding_box(model, layout);
    out.extend([
        pose.score,
        candidates
            .get(1)
            .map_or(FAR, |candidate| (pose.score - candidate.score).min(FAR)),
        candidates.len().min(MOST_CANDIDATES) as f32 / MOST_CANDIDATES as f32,
        box_side(model, layout, pose, 0).ln() as f32,
        (tile.height_px() / layout.image_size[1] as f64) as f32,
        ((x2 - x1 + 1.0) / (y2 - y1 + 1.0)) as f32,
        responses,
        springs,
    ]);
    Ok(())
}

/// Height of a part's box, in pixels.
fn box_side(model: &Model, layout: &Layout, pose: &Pose, part: usize) -> f64 {
    let [_, y1, _, y2] = pose.part_box(model, layout, part);
    y2 - y1 + 1.0
}

/// Scores of the spring to the parent, and of the pair of types.
fn edge(model: &Model, pose: &Pose, part: usize) -> [f32; 2] {
    let Some(edge) = &model.spec().parts[part].edge else {
        return [0.0, 0.0];
    };
    let (child, parent) = (pose.parts[part], pose.parts[edge.parent]);
    let [k, l] = [child.mixture, parent.mixture].map(usize::from);
    let spring = match &edge.springs {
        Springs::PerChildType(springs) => Some(springs[k]),
        Springs::PerTypePair(springs) => springs[l][k],
    };
    let offset = |parent: u16, anchor: i32, child: u16| {
        f64::from(i32::from(parent) + anchor - i32::from(child))
    };
    let cost = spring.map_or(0.0, |spring| {
        let dx = offset(parent.x, spring.anchor[0], child.x);
        let dy = offset(parent.y, spring.anchor[1], child.y);
        -(spring.w[0] * dx * dx + spring.w[1] * dx + spring.w[2] * dy * dy + spring.w[3] * dy)
    });
    [cost as f32, edge.bias[l][k].max(IMPOSSIBLE) as f32]
}

#[cfg(test)]
mod tests;
