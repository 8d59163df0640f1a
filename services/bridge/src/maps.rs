//! The maps of a view to Gaussians and back: what of the evidence crosses with the poses.

use std::sync::Arc;

use crate::hosts::{Gaussian, MOST_GAUSSIANS, Maps, MapsError};
use fmp::{Bound, Bounds, Layout, Region, Scope};
use messages::EvidenceHeader;
use posenetwork::{Bump, MOST_OF_A_JOINT, MapSettings, bumps, fill_from_bumps};
use recording::Kind;
use skeleton::PARSE14;
use wire::WireError;

const _: () = assert!(
    PARSE14.joints.len() * MOST_OF_A_JOINT <= MOST_GAUSSIANS,
    "all that a view can have"
);

/// The maps of a view, and how long their responses may be.
#[derive(Debug, Clone)]
pub struct ViewMaps {
    /// The pyramid of the view.
    pub layout: Arc<Layout>,
    /// Most values of its evidence.
    pub longest: usize,
}

/// Maps from another host that were checked.
#[derive(Debug, Clone)]
pub(crate) struct Checked {
    scope: Scope,
    bumps: Vec<Bump>,
}

/// Why maps from another host are refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refused {
    #[error(transparent)]
    Format(#[from] MapsError),
    #[error("maps of a region that the view does not have: {0}")]
    Scope(#[from] fmp::ScopeError),
    #[error("maps of {n} cells, at most {longest}")]
    Cells { n: usize, longest: usize },
    #[error("Gaussian {0} of the maps is none")]
    Gaussian(usize),
}

impl ViewMaps {
    /// The evidence of a view as bytes.
    ///
    /// # Errors
    ///
    /// It is not that of the view.
    pub(crate) fn pack(
        &self,
        header: &EvidenceHeader,
        values: &[f32],
    ) -> Result<Vec<u8>, WireError> {
        let evidence = wire::evidence_from_message(header, values, &self.layout)?;
        let responses = evidence.responses();
        let region = responses.scope().region();
        let gaussian = |it: Bump| Gaussian {
            joint: it.joint as u32,
            at: it.at,
            heat: it.heat,
            precision: it.precision,
        };
        let found = bumps(&responses, &MapSettings::default());
        let maps = Maps {
            level: responses.levels().first().copied().unwrap_or_default(),
            x: region.x,
            y: region.y,
            gaussians: found.into_iter().map(gaussian).collect(),
        };
        Ok(maps.to_bytes())
    }

    /// Reads and checks what another host made of its evidence.
    pub(crate) fn unpack(&self, bytes: &[u8]) -> Result<Checked, Refused> {
        let maps = Maps::parse(bytes)?;
        let levels = maps.level..maps.level.saturating_add(1);
        let region = Region {
            x: maps.x,
            y: maps.y,
        };
        let scope = Scope::new(&self.layout, levels, region)?;
        let n = self.layout.n_values(&scope);
        if n > self.longest {
            return Err(Refused::Cells {
                n,
                longest: self.longest,
            });
        }
        let bump = |(nth, it): (usize, &Gaussian)| {
            let bump = Bump {
                joint: it.joint as usize,
                at: it.at,
                heat: it.heat,
                precision: it.precision,
            };
            bump.is_sound()
                .then_some(bump)
                .ok_or(Refused::Gaussian(nth))
        };
        let bumps: Result<Vec<Bump>, Refused> =
            maps.gaussians.iter().enumerate().map(bump).collect();
        Ok(Checked {
            scope,
            bumps: bumps?,
        })
    }

    /// Number of values of the evidence.
    pub(crate) fn n_values(&self, maps: &Checked) -> usize {
        self.layout.n_values(&maps.scope)
    }

    /// Writes the evidence, and returns its header without stamp and times.
    ///
    /// * `values`: as many as [`Self::n_values`].
    pub(crate) fn fill(
        &self,
        maps: &Checked,
        values: &mut [f32],
    ) -> Result<EvidenceHeader, WireError> {
        let place = (&*self.layout, &maps.scope);
        fill_from_bumps(&maps.bumps, place, &MapSettings::default(), values);
        let levels: Vec<u16> = maps.scope.levels().collect();
        let bounds = Bounds::new(vec![Bound::UNKNOWN; self.layout.levels.len()]);
        wire::evidence_to_message(&levels, &bounds, &maps.scope, &self.layout)
    }
}

/// A body of poses and maps: the length of the poses (`u32`, little endian), the poses as in a recording without the zeros at their end,
/// which are most of them, and the maps.
pub(crate) fn join(poses: &[u8], maps: &[u8]) -> Vec<u8> {
    let end = poses.iter().rposition(|it| *it != 0).map_or(0, |it| it + 1);
    let mut body = Vec::with_capacity(4 + end + maps.len());
    body.extend_from_slice(&(end as u32).to_le_bytes());
    body.extend_from_slice(&poses[..end]);
    body.extend_from_slice(maps);
    body
}

/// The poses of a body, whole again, and its maps. None if it is cut off, or longer than poses can be.
pub(crate) fn split(body: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let (length, rest) = body.split_first_chunk()?;
    let (poses, maps) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let mut whole = Vec::new();
    recording::encode(Kind::ViewPose, &[], &[], &mut whole);
    if poses.len() > whole.len() {
        return None;
    }
    whole[..poses.len()].copy_from_slice(poses);
    whole[poses.len()..].fill(0);
    Some((whole, maps))
}

#[cfg(test)]
mod tests {
    use fmp::Responses;
    use posenetwork::springs::{SpringSettings, learn};

    use super::*;

    fn person(nth: usize) -> [[f64; 2]; 14] {
        core::array::from_fn(|it| [(it * 3 + nth % 3) as f64, (it * 5 % 60 + nth % 2) as f64])
    }

    fn view(longest: usize) -> ViewMaps {
        let people: Vec<_> = (0..30).map(person).collect();
        let model = learn(&people, &SpringSettings::default()).unwrap();
        ViewMaps {
            layout: Arc::new(Layout::new(&model, 160, 200).unwrap()),
            longest,
        }
    }

    fn maps() -> Maps {
        let gaussian = |joint: u32| Gaussian {
            joint,
            at: [40.5, 52.25],
            heat: 0.8,
            precision: [0.25, 0.0, 0.25],
        };
        Maps {
            level: 0,
            x: [20, 150],
            y: [30, 180],
            gaussians: (0..14).map(gaussian).collect(),
        }
    }

    #[test]
    fn evidence_crosses() {
        let view = view(1 << 20);
        let checked = view.unpack(&maps().to_bytes()).unwrap();
        let mut values = vec![0.0; view.n_values(&checked)];
        let header = view.fill(&checked, &mut values).unwrap();
        let again = view.unpack(&view.pack(&header, &values).unwrap()).unwrap();
        let mut others = vec![0.0; view.n_values(&again)];
        assert_eq!(view.fill(&again, &mut others).unwrap(), header);
        let settings = MapSettings::default();
        let off = values.iter().zip(&others);
        let off = off.map(|(a, b)| (settings.heat(*a) - settings.heat(*b)).abs());
        assert!(off.fold(0.0, f64::max) < 0.03);
        let evidence = wire::evidence_from_message(&header, &others, &view.layout).unwrap();
        let responses: Responses<'_> = evidence.responses();
        let window = responses.window(0);
        let at = (52 - window.top) * window.cols + 41 - window.left;
        assert!(settings.heat(responses.map(0, 13)[at]) > 0.7);
    }

    #[test]
    fn what_the_view_cannot_have_is_refused_with_the_number() {
        let refused = |change: fn(&mut Maps), longest| {
            let mut maps = maps();
            change(&mut maps);
            let error = view(longest).unpack(&maps.to_bytes()).unwrap_err();
            error.to_string()
        };
        let room = 1 << 20;
        assert!(refused(|it| it.x = [20, 161], room).contains("161"));
        assert!(refused(|it| it.level = u16::MAX, room).contains("levels"));
        assert!(refused(|_| {}, 100).contains("at most 100"));
        assert!(refused(|it| it.gaussians[3].heat = f32::NAN, room).contains("Gaussian 3"));
        assert!(refused(|it| it.gaussians[2].joint = 14, room).contains("Gaussian 2"));
        let cut = maps().to_bytes();
        let cut = view(room).unpack(&cut[..30]).unwrap_err().to_string();
        assert!(cut.contains("30 bytes"), "{cut}");
    }

    #[test]
    fn poses_and_maps_of_a_body_come_back_whole() {
        let mut poses = Vec::new();
        recording::encode(Kind::ViewPose, &[7; 900], &[], &mut poses);
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
