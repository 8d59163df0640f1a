//! Converts the maps of a view to Gaussians and back. The Gaussians are sent with the poses.

use crate::hosts::{Gaussian, MOST_GAUSSIANS, Maps, MapsError, PersonGaussians};
use messages::{EvidenceHeader, GridMessage, MAX_CANDIDATES};
use posenetwork::{Bump, MOST_OF_A_JOINT, MapGrid, MapSettings, bumps, fill_from_bumps};
use recording::Kind;
use skeleton::PARSE14;
use wire::WireError;

const _: () = assert!(
    MAX_CANDIDATES * PARSE14.joints.len() * MOST_OF_A_JOINT <= MOST_GAUSSIANS,
    "the maps of a view must fit"
);

/// Properties of a view's maps.
#[derive(Debug, Clone, Copy)]
pub struct ViewMaps {
    /// Width and height of the frames, in pixels.
    pub size: [usize; 2],
    /// Maximum number of values in the evidence.
    pub longest: usize,
}

/// Checked maps from another host.
#[derive(Debug, Clone)]
pub(crate) struct Checked {
    header: EvidenceHeader,
    grids: Vec<MapGrid>,
    /// Gaussians, by person.
    bumps: Vec<Vec<Bump>>,
}

/// Reason why maps from another host are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Refused {
    #[error(transparent)]
    Format(#[from] MapsError),
    #[error(transparent)]
    Wire(#[from] WireError),
    #[error("the message has {0} people, which is too many")]
    People(usize),
    #[error("the maps have {n} cells, but at most {longest} are allowed")]
    Cells { n: usize, longest: usize },
    #[error("Gaussian {nth} of the maps of person {person} has invalid values")]
    Gaussian { person: usize, nth: usize },
}

impl ViewMaps {
    /// Returns the evidence of a view as bytes.
    ///
    /// # Errors
    ///
    /// Fails if the evidence does not have the form of a view's evidence.
    pub(crate) fn pack(header: &EvidenceHeader, values: &[f32]) -> Result<Vec<u8>, WireError> {
        let gaussian = |bump: Bump| Gaussian {
            joint: bump.joint as u32,
            at: bump.at,
            heat: bump.heat,
            precision: bump.precision,
        };
        let maps = wire::maps_from_message(header, values)?;
        let people = maps.iter().map(|maps| PersonGaussians {
            first_px: maps.grid().first_px,
            cell_px: maps.grid().cell_px,
            size: maps.grid().size.map(|side| side as u32),
            gaussians: bumps(maps, &MapSettings::default()).into_iter().map(gaussian).collect(),
        });
        let maps = Maps {
            people: people.collect(),
        };
        Ok(maps.to_bytes())
    }

    /// Reads and checks the Gaussians that another host computed from its evidence.
    pub(crate) fn unpack(&self, bytes: &[u8]) -> Result<Checked, Refused> {
        let maps = Maps::parse(bytes)?;
        if maps.people.len() > MAX_CANDIDATES {
            return Err(Refused::People(maps.people.len()));
        }
        let mut header = wire::maps_to_message(&[], self.size)?;
        header.n_people = maps.people.len() as u32;
        for (slot, person) in header.people.iter_mut().zip(&maps.people) {
            *slot = GridMessage {
                first_px: person.first_px,
                cell_px: person.cell_px,
                size: person.size,
                ..GridMessage::default()
            };
        }
        let grids = wire::grids_from_message(&header)?;
        let n = wire::n_values(&grids);
        if n > self.longest {
            return Err(Refused::Cells {
                n,
                longest: self.longest,
            });
        }
        let mut bumps = Vec::with_capacity(grids.len());
        for (person, sent) in maps.people.iter().enumerate() {
            let all: Vec<Bump> = sent.gaussians.iter().map(bump).collect();
            if let Some(nth) = all.iter().position(|bump| !bump.is_sound()) {
                return Err(Refused::Gaussian { person, nth });
            }
            bumps.push(all);
        }
        Ok(Checked {
            header,
            grids,
            bumps,
        })
    }
}

fn bump(gaussian: &Gaussian) -> Bump {
    Bump {
        joint: gaussian.joint as usize,
        at: gaussian.at,
        heat: gaussian.heat,
        precision: gaussian.precision,
    }
}

impl Checked {
    /// Returns the number of values in the evidence.
    pub(crate) fn n_values(&self) -> usize {
        wire::n_values(&self.grids)
    }

    /// Writes the evidence, and returns its header without stamp and times.
    ///
    /// * `values`: buffer of [`Self::n_values`] values.
    pub(crate) fn fill(&self, values: &mut [f32]) -> EvidenceHeader {
        let mut left = values;
        for (grid, bumps) in self.grids.iter().zip(&self.bumps) {
            let (own, others) = left.split_at_mut(grid.n_values());
            fill_from_bumps(bumps, grid.size, &MapSettings::default(), own);
            left = others;
        }
        self.header
    }
}

/// Returns a body with poses and maps: the length of the poses (`u32`, little endian), the poses as in a recording, and the maps. Zeros at
/// the end of the poses are left out.
pub(crate) fn join(poses: &[u8], maps: &[u8]) -> Vec<u8> {
    let end = poses.iter().rposition(|pose| *pose != 0).map_or(0, |index| index + 1);
    let mut body = Vec::with_capacity(4 + end + maps.len());
    body.extend_from_slice(&(end as u32).to_le_bytes());
    body.extend_from_slice(&poses[..end]);
    body.extend_from_slice(maps);
    body
}

/// Splits a body into complete poses and maps. Returns `None` if the body is truncated, or the poses are too long.
pub(crate) fn split(body: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let (length, rest) = body.split_first_chunk()?;
    let (poses, maps) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let mut whole = Vec::new();
    recording::encode(Kind::Sightings, &[], &[], &mut whole);
    if poses.len() > whole.len() {
        return None;
    }
    whole[..poses.len()].copy_from_slice(poses);
    whole[poses.len()..].fill(0);
    Some((whole, maps))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(longest: usize) -> ViewMaps {
        ViewMaps {
            size: [160, 200],
            longest,
        }
    }

    fn maps() -> Maps {
        let gaussian = |joint: u32| Gaussian {
            joint,
            at: [20.5, 32.25],
            heat: 0.8,
            precision: [0.25, 0.0, 0.25],
        };
        let person = |x: f64| PersonGaussians {
            first_px: [x, 30.0],
            cell_px: [2.0; 2],
            size: [48, 64],
            gaussians: (0..14).map(gaussian).collect(),
        };
        Maps {
            people: vec![person(20.0), person(60.0)],
        }
    }

    #[test]
    fn evidence_survives_the_transfer_between_hosts() {
        let view = view(1 << 20);
        let checked = view.unpack(&maps().to_bytes()).unwrap();
        let mut values = vec![0.0; checked.n_values()];
        let header = checked.fill(&mut values);
        let again = view.unpack(&ViewMaps::pack(&header, &values).unwrap()).unwrap();
        let mut others = vec![0.0; again.n_values()];
        assert_eq!(again.fill(&mut others), header);
        let settings = MapSettings::default();
        let off = values.iter().zip(&others);
        let off = off.map(|(a, b)| (settings.heat(*a) - settings.heat(*b)).abs());
        assert!(off.fold(0.0, f64::max) < 0.03);
        let maps = wire::maps_from_message(&header, &others).unwrap();
        let heat = settings.heat(maps[1].at(13, [60.0 + 41.0, 30.0 + 64.5]));
        assert!(heat > 0.7, "{heat}");
    }

    #[test]
    fn maps_that_do_not_fit_the_view_are_refused_with_the_number() {
        let refused = |change: fn(&mut Maps), longest| {
            let mut maps = maps();
            change(&mut maps);
            let error = view(longest).unpack(&maps.to_bytes()).unwrap_err();
            error.to_string()
        };
        let room = 1 << 20;
        assert!(refused(|maps| maps.people[1].size = [0, 64], room).contains("grid.size"));
        assert!(refused(|maps| maps.people[0].cell_px[0] = f64::NAN, room).contains("NaN"));
        assert!(refused(|maps| maps.people = vec![maps.people[0].clone(); 9], room).contains('9'));
        assert!(refused(|_| {}, 100).contains("at most 100"));
        let heat = refused(|maps| maps.people[1].gaussians[3].heat = f32::NAN, room);
        assert!(
            heat.contains("Gaussian 3 of the maps of person 1"),
            "{heat}"
        );
        assert!(
            refused(|maps| maps.people[0].gaussians[2].joint = 14, room).contains("Gaussian 2")
        );
        let cut = maps().to_bytes();
        let cut = view(room).unpack(&cut[..30]).unwrap_err().to_string();
        assert!(cut.contains("30 bytes"), "{cut}");
    }

    #[test]
    fn poses_and_maps_survive_joining_and_splitting() {
        let mut poses = Vec::new();
        recording::encode(Kind::Sightings, &[7; 900], &[], &mut poses);
        let body = join(&poses, b"maps");
        assert!(body.len() < 920, "{}", body.len());
        assert_eq!(split(&body), Some((poses.clone(), &b"maps"[..])));
        assert_eq!(split(&join(&poses, b"")), Some((poses.clone(), &b""[..])));
        assert_eq!(split(&body[..500]), None);
        assert_eq!(split(b"abc"), None);
        let long = vec![1; poses.len() + 1];
        assert_eq!(split(&join(&long, b"")), None);
    }
}
