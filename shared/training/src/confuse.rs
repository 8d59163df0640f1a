//! Loss-augmented inference: finds wrong poses of a person that score as well as the right one.

use std::sync::Arc;

use crate::datasets::Picture;
use fmp::{ExtraTerms, Extractor, Layout, Model, Pose, Responses, Solver};

use crate::latent::Marked;

/// Searches images of people for the pose with the largest margin violation.
#[derive(Debug)]
pub(crate) struct Confuser {
    model: Arc<Model>,
    extractor: Extractor,
    solver: Solver,
}

/// The loss of a pose: the mean of the losses of its parts, each between 0 and the same maximum.
///
/// The solver adds this loss to the scores, which gives loss-augmented inference.
#[derive(Debug)]
pub(crate) struct Loss<'a> {
    layout: &'a Layout,
    side: usize,
    marked: &'a Marked,
    /// Largest loss of a part.
    weight: f64,
}

/// Returns the loss for the poses of one person.
///
/// * `worst`: loss of a pose with all parts wrong.
pub(crate) fn loss<'a>(
    model: &Model,
    layout: &'a Layout,
    marked: &'a Marked,
    worst: f64,
) -> Loss<'a> {
    Loss {
        layout,
        side: model.max_filter()[0],
        marked,
        weight: worst / model.n_parts() as f64,
    }
}

impl Loss<'_> {
    /// Loss of a part whose centre is `off` pixels from the marked centre. It is 0 up to a quarter of the box's
    /// side, and 1 from three quarters on.
    fn of_part(&self, off: f64) -> f64 {
        self.weight * ((off / self.marked.side - 0.25) / 0.5).clamp(0.0, 1.0)
    }

    /// Loss of a whole pose.
    pub(crate) fn of_pose(&self, model: &Model, pose: &Pose) -> f64 {
        let centres = pose.centres(model, self.layout);
        let off = centres.iter().zip(&self.marked.parts);
        off.map(|(a, b)| self.of_part((a[0] - b[0]).hypot(a[1] - b[1]))).sum()
    }
}

impl ExtraTerms for Loss<'_> {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let it = &self.layout.levels[level];
        let half = (self.side as f64 * it.scale - 1.0) / 2.0;
        let [x, y] = self.marked.parts[part];
        for (at, score) in (first..).zip(score) {
            let (row, col) = (at / it.cols, at % it.cols);
            let dx = (col as f64 - self.layout.pad[1] as f64) * it.scale + half - x;
            let dy = (row as f64 - self.layout.pad[0] as f64) * it.scale + half - y;
            *score += self.of_part(dx.hypot(dy)) as f32;
        }
        true
    }

    fn of_type(&self, _part: usize, _mixture: usize) -> f32 {
        0.0
    }
}

impl Confuser {
    /// Prepares the search.
    pub(crate) fn new(model: Model) -> Self {
        let model = Arc::new(model);
        Self {
            extractor: Extractor::new(Arc::clone(&model)),
            solver: Solver::new(Arc::clone(&model)),
            model,
        }
    }

    /// The pose with the largest sum of score and loss; `None` if the image is too small for the model.
    ///
    /// * `worst`: loss of a pose with all parts wrong.
    pub(crate) fn worst(&self, picture: &Picture, marked: &Marked, worst: f64) -> Option<Pose> {
        let image = picture.view();
        let layout = Layout::new(&self.model, image.width(), image.height()).ok()?;
        let mut values = vec![0.0; layout.n_responses()];
        self.extractor.responses(image, &layout, &mut values);
        let levels: Vec<_> = (0..layout.levels.len() as u16).collect();
        let evidence = Responses::new(&layout, &values, &levels);
        let loss = loss(&self.model, &layout, marked, worst);
        self.solver.best(&evidence, Some(&loss))
    }
}
