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

#[cfg(test)]
mod tests {
    use super::*;

    const PARENTS: [Option<usize>; 3] = [None, Some(0), Some(1)];

    /// People whose second part hangs to the left, below, or to the right, and whose third one always
    /// lies below that.
    fn people() -> Vec<Vec<[f64; 2]>> {
        let person = |it: usize| {
            let jitter = 0.1 * (it % 7) as f64;
            let arm = [[-5.0, 1.0], [0.2, 5.0], [6.0, 0.0], [6.0, 0.0]][it % 4];
            let second = [10.0 + arm[0] + jitter, 10.0 + arm[1] - jitter];
            vec![[10.0, 10.0], second, [second[0], second[1] + 4.0]]
        };
        (0..40).map(person).collect()
    }

    fn settings(n_types: usize, types_by: TypesBy) -> Settings {
        Settings {
            n_types,
            types_by,
            cluster_starts: 20,
            ..Settings::default()
        }
    }

    #[test]
    fn clusters_are_found_the_largest_first() {
        let types = cluster(&people(), &PARENTS, &settings(3, TypesBy::Parent));
        let of_second: Vec<_> = types.of_person.iter().map(|it| it[1]).collect();
        assert_eq!(types.anchors[1][0], [6, 0], "half of the people");
        for (person, label) in of_second.iter().enumerate() {
            assert_eq!(of_second[person % 4], *label, "person {person}");
        }
        assert_eq!(of_second[2], of_second[3]);
        assert_ne!(of_second[0], of_second[1]);
    }

    #[test]
    fn neighbours_tell_apart_what_the_parent_does_not() {
        let by_parent = cluster(&people(), &PARENTS, &settings(3, TypesBy::Parent));
        assert_eq!(
            by_parent.anchors[2].len(),
            by_parent.anchors[2].iter().len()
        );
        assert!(by_parent.anchors[2].iter().all(|it| *it == [0, 4]));
        let by_all = cluster(&people(), &PARENTS, &settings(3, TypesBy::Neighbours));
        let spread = |types: &Types| {
            let labels = types.of_person.iter().map(|it| it[1]);
            labels.collect::<std::collections::BTreeSet<_>>().len()
        };
        assert_eq!(spread(&by_all), 3);
    }

    #[test]
    fn few_people_have_few_types() {
        let types = cluster(&people()[..2], &PARENTS, &settings(6, TypesBy::Parent));
        assert!(types.anchors.iter().all(|it| (1..=2).contains(&it.len())));
        let fits =
            |person: &Vec<usize>| person.iter().zip(&types.anchors).all(|(a, b)| *a < b.len());
        assert!(types.of_person.iter().all(fits));
    }

    #[test]
    fn the_seed_decides() {
        let people = people();
        let twice = [0, 1].map(|_| cluster(&people, &PARENTS, &settings(2, TypesBy::Parent)));
        assert_eq!(twice[0], twice[1]);
    }
}
