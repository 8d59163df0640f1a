//! Types of parts: clusters of where a part lies relative to its neighbours.

use rayon::prelude::*;

use crate::settings::Settings;

/// What the types of a part are told apart by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TypesBy {
    /// The offset from the parent; of the root, that of its first child (Yang & Ramanan 2013).
    Parent,
    /// The offsets from the parent and from all children (the 2014 release).
    Neighbours,
}

/// The type of every person's part, and where the types rest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Types {
    /// Type of every part of every person: `[person][part]`.
    pub of_person: Vec<Vec<usize>>,
    /// Mean offset of a type from its parent `[x, y]`, cells, rounded: `[part][type]`.
    pub anchors: Vec<Vec<[i32; 2]>>,
}

/// Clusters every part of all people into types by k-means.
///
/// Fewer types are found where fewer people differ.
///
/// * `people`: centres of the parts of every person, in cells of the level at which the person has
///   the size of the model.
pub(crate) fn cluster(
    people: &[Vec<[f64; 2]>],
    parents: &[Option<usize>],
    settings: &Settings,
) -> Types {
    let labels: Vec<Vec<usize>> = (0..parents.len())
        .into_par_iter()
        .map(|part| {
            let neighbours = neighbours(parents, part, settings.types_by);
            let features = people.iter().map(|it| {
                let offsets = neighbours.iter().flat_map(|&of| offset(it, part, of));
                offsets.collect()
            });
            let features: Vec<Vec<f64>> = features.collect();
            let mut random = fastrand::Rng::with_seed(settings.seed ^ ((part as u64) << 32));
            k_means(&features, settings, &mut random)
        })
        .collect();
    let anchor_of = |(part, labels): (usize, &Vec<usize>)| {
        let mut sums = vec![[0.0; 3]; labels.iter().max().map_or(0, |it| it + 1)];
        for (person, &label) in people.iter().zip(labels) {
            let [x, y] = parents[part].map_or([0.0; 2], |of| offset(person, part, of));
            let sum = &mut sums[label];
            *sum = [sum[0] + x, sum[1] + y, sum[2] + 1.0];
        }
        let mean = |[x, y, n]: &[f64; 3]| [x / n, y / n].map(|it| it.round() as i32);
        sums.iter().map(mean).collect()
    };
    Types {
        anchors: labels.iter().enumerate().map(anchor_of).collect(),
        of_person: (0..people.len())
            .map(|person| labels.iter().map(|it| it[person]).collect())
            .collect(),
    }
}

/// The parts whose offsets tell the types of `part` apart.
fn neighbours(parents: &[Option<usize>], part: usize, by: TypesBy) -> Vec<usize> {
    let children = (0..parents.len()).filter(|&it| parents[it] == Some(part));
    let mut found: Vec<_> = parents[part].into_iter().collect();
    match by {
        TypesBy::Parent if found.is_empty() => found.extend(children.take(1)),
        TypesBy::Parent => {}
        TypesBy::Neighbours => found.extend(children),
    }
    found
}

/// Where `part` lies as seen from `of`.
fn offset(person: &[[f64; 2]], part: usize, of: usize) -> [f64; 2] {
    [0, 1].map(|axis| person[part][axis] - person[of][axis])
}

/// Lloyd's algorithm from several random starts; the labels of the tightest clusters.
///
/// Labels are numbered from 0 without gaps, larger clusters first.
fn k_means(points: &[Vec<f64>], settings: &Settings, random: &mut fastrand::Rng) -> Vec<usize> {
    let mut best: Option<(f64, Vec<usize>)> = None;
    for _ in 0..settings.cluster_starts.max(1) {
        let picked = random.choose_multiple(0..points.len(), settings.n_types);
        let centres = picked.into_iter().map(|it| points[it].clone()).collect();
        let (spread, labels) = lloyd(points, centres);
        if best.as_ref().is_none_or(|it| spread < it.0) {
            best = Some((spread, labels));
        }
    }
    by_size(best.map(|it| it.1).unwrap_or_default(), settings.n_types)
}

fn lloyd(points: &[Vec<f64>], mut centres: Vec<Vec<f64>>) -> (f64, Vec<usize>) {
    let mut labels = vec![usize::MAX; points.len()];
    let mut spread = 0.0;
    for _ in 0..MAX_ROUNDS {
        spread = 0.0;
        let mut moved = false;
        for (point, label) in points.iter().zip(&mut labels) {
            let distances = centres.iter().map(|it| squared_distance(point, it));
            let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((it, distance)) = nearest {
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
    let mut counts: Vec<_> = (0..k).map(|it| (0_usize, it)).collect();
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

/// Rounds after which a start that still moves is taken as it is.
const MAX_ROUNDS: usize = 1000;
