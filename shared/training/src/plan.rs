//! The plan of a training run: sizes of the people and types of their parts, computed from the annotations without images.

use crate::latent::Marked;
use crate::scale::{box_sides, filter_side};
use crate::settings::Settings;
use crate::shape::Shape;
use crate::types::{Types, cluster};

/// The tree of a model's parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Names of the parts, root first.
    pub names: Vec<String>,
    /// Parent of every part, with a smaller index than the part; `None` for the root, which is part 0.
    pub parents: Vec<Option<usize>>,
    /// For each part, the corresponding part on the other side of the body.
    pub mirror: Option<Vec<usize>>,
}

impl Tree {
    /// Returns the parents, and the mirror if the settings require a symmetric model.
    fn sides(&self, settings: &Settings) -> (&[Option<usize>], Option<&[usize]>) {
        let mirror = self.mirror.as_deref().filter(|_| settings.symmetric);
        (&self.parents, mirror)
    }
}

/// The people to train on, and the shape of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    shape: Shape,
    people: Vec<Planned>,
}

/// A person of the training set.
#[derive(Debug, Clone, PartialEq)]
struct Planned {
    /// Number of the person in the [`Album`](crate::Album).
    person: usize,
    parts: Vec<[f64; 2]>,
    side: f64,
    types: Vec<usize>,
}

/// Reason why a training run is not possible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// No person is large enough.
    #[error(
        "of {n_people} people, none is large enough for filters of {filter_px} pixels: use larger pictures or smaller filters"
    )]
    NoPeople {
        /// Number of people in the album.
        n_people: usize,
        /// Side of the filters at full resolution, in pixels.
        filter_px: usize,
    },
    /// The parts of a person are incomplete.
    #[error("person {person} has {got} finite parts, expected {expected}")]
    Parts {
        /// Number of the person in the album, from 1.
        person: usize,
        /// Number of parts with finite coordinates.
        got: usize,
        /// Number of parts of the model.
        expected: usize,
    },
    /// The people are too small for the smallest filter.
    #[error(
        "the people are too small: 95 of 100 have heads of more than {side_px:.1} pixels, and the filters would have {cells} cells, expected at least 3; enlarge the pictures"
    )]
    Small {
        /// Fifth percentile of the sides of the part boxes, in pixels.
        side_px: f64,
        /// Side of the largest filter that fits, in cells.
        cells: usize,
    },
}

impl Plan {
    /// Estimates the sizes of the people, leaves out people who are smaller than the filters, and clusters the parts.
    ///
    /// * `people`: centres of the parts of every person in the album, in pixels of the image.
    ///
    /// # Errors
    ///
    /// See [`PlanError`].
    pub fn new(
        name: &str,
        tree: &Tree,
        people: &[Vec<[f64; 2]>],
        settings: &Settings,
    ) -> Result<Self, PlanError> {
        let expected = tree.parents.len();
        for (person, parts) in people.iter().enumerate() {
            let finite = |part: &&[f64; 2]| part.iter().all(|value| value.is_finite());
            let got = parts.iter().filter(finite).count();
            if got != expected || parts.len() != expected {
                let person = person + 1;
                return Err(PlanError::Parts {
                    person,
                    got,
                    expected,
                });
            }
        }
        let sides = box_sides(people, &tree.parents);
        let (fits, side_px) = filter_side(&sides, settings.cell_px);
        if fits < LEAST_CELLS && !people.is_empty() {
            let cells = fits;
            return Err(PlanError::Small { side_px, cells });
        }
        let side = fits.min(settings.max_filter_cells);
        let filter_px = side * settings.cell_px;
        let large: Vec<usize> =
            (0..people.len()).filter(|&i| sides[i] >= filter_px as f64).collect();
        if large.is_empty() {
            let n_people = people.len();
            return Err(PlanError::NoPeople {
                n_people,
                filter_px,
            });
        }
        let in_cells = |&i: &usize| {
            let scale = side as f64 / sides[i];
            people[i].iter().map(|at| at.map(|px| px * scale)).collect()
        };
        let in_cells: Vec<Vec<[f64; 2]>> = large.iter().map(in_cells).collect();
        let Types { of_person, anchors } = cluster(&in_cells, tree.sides(settings), settings);
        let planned = large.iter().zip(of_person).map(|(&person, types)| Planned {
            person,
            parts: people[person].clone(),
            side: sides[person],
            types,
        });
        Ok(Self {
            people: planned.collect(),
            shape: Shape {
                name: name.to_owned(),
                part_names: tree.names.clone(),
                parents: tree.parents.clone(),
                mirror: tree.mirror.clone(),
                anchors,
                side,
                cell_px: settings.cell_px,
                interval: settings.interval,
            },
        })
    }

    /// The model's shape.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Number of people to train on.
    pub fn n_people(&self) -> usize {
        self.people.len()
    }

    /// Number of a training person in the [`Album`](crate::Album). `it` is the person's number in the plan.
    pub fn person(&self, it: usize) -> usize {
        self.people[it].person
    }

    /// Positions of a person's parts. If `with_types` is set, each part must have the type of its cluster; otherwise, any type is allowed.
    pub fn marked(&self, it: usize, with_types: bool) -> Marked {
        let person = &self.people[it];
        Marked {
            parts: person.parts.clone(),
            side: person.side,
            types: with_types.then(|| person.types.clone()),
        }
    }
}

/// Minimum side of a filter, in cells.
const LEAST_CELLS: usize = 3;
