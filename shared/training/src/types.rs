//! Types of parts: clusters of a part's offsets from its neighbours.

use rayon::prelude::*;

use crate::settings::{Settings, TypesBy};

/// The types of every person's parts, and the anchors of the types.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Types {
    /// Type of every part of every person: `[person][part]`.
    pub of_person: Vec<Vec<usize>>,
    /// Mean offset of a type from its parent, `[x, y]` in whole cells: `[part][type]`.
    pub anchors: Vec<Vec<[i32; 2]>>,
}

/// Clusters every part of all people into types by k-means.
///
/// If `mirror` is given, type `k` of a part is the mirror image of type `k` of the part on the other side. The types of a part in the
/// middle come in mirrored pairs: 0 and 1, 2 and 3, and so on. If the number of types is odd, such a part has one type fewer.
///
/// There are fewer types if there are fewer different people.
///
/// * `people`: centres of the parts of every person, in cells of the level at which the person has
///   the size of the model.
/// * `mirror`: the part on the other side of the body. The mirror must be its own inverse and keep the tree.
pub(crate) fn cluster(
    people: &[Vec<[f64; 2]>],
    (parents, mirror): (&[Option<usize>], Option<&[usize]>),
    settings: &Settings,
) -> Types {
    let other = |part: usize| mirror.map_or(part, |mirror| mirror[part]);
    let clustered = |part: usize| -> Vec<(usize, OfPart)> {
        let mut random = fastrand::Rng::with_seed(settings.seed ^ ((part as u64) << 32));
        let sight = Offsets::new(part, parents, settings.types_by);
        match mirror {
            Some(mirror) if other(part) == part && settings.n_types > 1 => {
                let both = [
                    sight.offsets(people),
                    sight.mirrored(mirror).offsets(people),
                ];
                vec![(part, in_the_middle(both, settings, &mut random))]
            }
            Some(mirror) if other(part) != part => {
                let own = OfPart::clustered(&sight.offsets(people), settings, &mut random);
                let theirs = sight.mirrored(mirror).offsets(people);
                let theirs = own.mirrored(&theirs);
                vec![(part, own), (other(part), theirs)]
            }
            _ => {
                let own = OfPart::clustered(&sight.offsets(people), settings, &mut random);
                vec![(part, own)]
            }
        }
    };
    let mut parts: Vec<(usize, OfPart)> = (0..parents.len())
        .into_par_iter()
        .filter(|&i| i <= other(i))
        .flat_map_iter(clustered)
        .collect();
    parts.sort_unstable_by_key(|part| part.0);
    let of_person = |person: usize| parts.iter().map(|part| part.1.labels[person]).collect();
    Types {
        of_person: (0..people.len()).map(of_person).collect(),
        anchors: parts.iter().map(|part| part.1.anchors()).collect(),
    }
}

/// The offsets by which a part is clustered.
struct Offsets {
    part: usize,
    neighbours: Vec<usize>,
    /// True if the offsets are mirrored.
    in_mirror: bool,
}

impl Offsets {
    /// Finds the parts whose offsets define the types of `part`. The first one is the parent of `part`.
    fn new(part: usize, parents: &[Option<usize>], by: TypesBy) -> Self {
        let children = (0..parents.len()).filter(|&i| parents[i] == Some(part));
        let mut neighbours: Vec<_> = parents[part].into_iter().collect();
        match by {
            TypesBy::Parent if neighbours.is_empty() => neighbours.extend(children.take(1)),
            TypesBy::Parent => {}
            TypesBy::Neighbours => neighbours.extend(children),
        }
        Self {
            part,
            neighbours,
            in_mirror: false,
        }
    }

    /// The corresponding offsets on the other side of the body.
    fn mirrored(&self, mirror: &[usize]) -> Self {
        Self {
            part: mirror[self.part],
            neighbours: self.neighbours.iter().map(|&neighbour| mirror[neighbour]).collect(),
            in_mirror: !self.in_mirror,
        }
    }

    /// Offsets from the neighbours in cells, one point per person: `x, y, x, y...`.
    fn offsets(&self, people: &[Vec<[f64; 2]>]) -> Vec<Vec<f64>> {
        let of_person = |person: &Vec<[f64; 2]>| {
            let from = |&of: &usize| {
                let [x, y] = [0, 1].map(|axis| person[self.part][axis] - person[of][axis]);
                [if self.in_mirror { -x } else { x }, y]
            };
            self.neighbours.iter().flat_map(from).collect()
        };
        people.iter().map(of_person).collect()
    }
}

/// The types of one part.
struct OfPart {
    /// Type of every person's part.
    labels: Vec<usize>,
    /// The centre of every type.
    centres: Vec<Vec<f64>>,
}

impl OfPart {
    fn clustered(points: &[Vec<f64>], settings: &Settings, random: &mut fastrand::Rng) -> Self {
        let labels = k_means(points, settings, random);
        let mut centres = vec![Vec::new(); labels.iter().max().map_or(0, |label| label + 1)];
        for (label, centre) in centres.iter_mut().enumerate() {
            let members = labels.iter().zip(points).filter(|member| *member.0 == label);
            *centre = middle(&mut members.map(|member| member.1));
        }
        Self { labels, centres }
    }

    /// Derives the types of the part on the other side of the body. Each person gets the type whose mirror image is nearest.
    ///
    /// * `points`: the mirrored offsets of the other side.
    fn mirrored(&self, points: &[Vec<f64>]) -> Self {
        let nearest = |point: &Vec<f64>| nearest(point, &self.centres).map_or(0, |centre| centre.0);
        Self {
            labels: points.iter().map(nearest).collect(),
            centres: self.centres.iter().map(|centre| in_mirror(centre)).collect(),
        }
    }

    /// The anchors of the types: `[x, y]` from the first neighbour, in cells.
    fn anchors(&self) -> Vec<[i32; 2]> {
        let anchor = |centre: &Vec<f64>| match centre[..] {
            [x, y, ..] => [x, y].map(|value| value.round() as i32),
            _ => [0; 2],
        };
        self.centres.iter().map(anchor).collect()
    }
}

/// Types of a part in the middle of the body, as mirrored pairs. Offsets to the left are mirrored before clustering.
///
/// * `both`: the offsets of every person, plain and mirrored.
fn in_the_middle(
    [plain, mirrored]: [Vec<Vec<f64>>; 2],
    settings: &Settings,
    random: &mut fastrand::Rng,
) -> OfPart {
    let is_left: Vec<bool> = plain.iter().zip(&mirrored).map(|(a, b)| a < b).collect();
    let right = plain.into_iter().zip(mirrored).map(|(a, b)| if a < b { b } else { a });
    let half = Settings {
        n_types: settings.n_types / 2,
        ..settings.clone()
    };
    let found = OfPart::clustered(&right.collect::<Vec<_>>(), &half, random);
    let label = |(label, is_left): (&usize, bool)| 2 * label + usize::from(is_left);
    let labels = found.labels.iter().zip(is_left).map(label).collect();
    let centres = found.centres.into_iter();
    let centres = centres.flat_map(|centre| [centre.clone(), in_mirror(&centre)]).collect();
    OfPart { labels, centres }
}

/// Mirrors a point.
fn in_mirror(point: &[f64]) -> Vec<f64> {
    let axes = point.iter().enumerate();
    axes.map(|(axis, it)| if axis % 2 == 0 { -it } else { *it }).collect()
}

fn middle(points: &mut dyn Iterator<Item = &Vec<f64>>) -> Vec<f64> {
    let (mut sum, mut n) = (Vec::new(), 0.0);
    for point in points {
        sum.resize(point.len(), 0.0);
        for (sum, value) in sum.iter_mut().zip(point) {
            *sum += value;
        }
        n += 1.0;
    }
    sum.into_iter().map(|sum| sum / n).collect()
}

/// Index of the nearest point and its squared distance; the first index if several are equally near.
fn nearest(point: &[f64], to: &[Vec<f64>]) -> Option<(usize, f64)> {
    let distances = to.iter().map(|other| squared_distance(point, other));
    distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Lloyd's algorithm from several random starts. Returns the labels of the tightest clusters.
///
/// Labels are numbered from 0 without gaps, larger clusters first.
fn k_means(points: &[Vec<f64>], settings: &Settings, random: &mut fastrand::Rng) -> Vec<usize> {
    let mut best: Option<(f64, Vec<usize>)> = None;
    for _ in 0..settings.cluster_starts.max(1) {
        let picked = random.choose_multiple(0..points.len(), settings.n_types);
        let centres = picked.into_iter().map(|picked| points[picked].clone()).collect();
        let (spread, labels) = lloyd(points, centres);
        if best.as_ref().is_none_or(|best| spread < best.0) {
            best = Some((spread, labels));
        }
    }
    by_size(
        best.map(|best| best.1).unwrap_or_default(),
        settings.n_types,
    )
}

fn lloyd(points: &[Vec<f64>], mut centres: Vec<Vec<f64>>) -> (f64, Vec<usize>) {
    let mut labels = vec![usize::MAX; points.len()];
    let mut spread = 0.0;
    for _ in 0..MAX_ROUNDS {
        spread = 0.0;
        let mut moved = false;
        for (point, label) in points.iter().zip(&mut labels) {
            if let Some((it, distance)) = nearest(point, &centres) {
                spread += distance;
                moved |= *label != it;
                *label = it;
            }
        }
        if !moved {
            break;
        }
        for (it, centre) in centres.iter_mut().enumerate() {
            let members: Vec<_> = (0..points.len()).filter(|&p| labels[p] == it).collect();
            for (axis, value) in centre.iter_mut().enumerate() {
                if !members.is_empty() {
                    let sum: f64 = members.iter().map(|&p| points[p][axis]).sum();
                    *value = sum / members.len() as f64;
                }
            }
        }
    }
    (spread, labels)
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn by_size(mut labels: Vec<usize>, k: usize) -> Vec<usize> {
    let mut counts: Vec<_> = (0..k).map(|i| (0_usize, i)).collect();
    for &label in &labels {
        counts[label].0 += 1;
    }
    counts.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut rank = vec![0; k];
    for (new, (_, old)) in counts.into_iter().enumerate() {
        rank[old] = new;
    }
    for label in &mut labels {
        *label = rank[*label];
    }
    labels
}

/// Maximum number of iterations from one start.
const MAX_ROUNDS: usize = 1000;

#[cfg(test)]
mod tests;
