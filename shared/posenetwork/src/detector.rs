//! A people detector with its card. It takes a picture and returns boxes.

use inference::{Input, Session};
use kernels::Rgb8View;
use keypoints::{Boxes, DetectorCard, Layout, PersonBox};

use crate::network::{FitError, LookError, as_taken, input_of, only};

/// A people detector that matches its card.
#[derive(Debug)]
pub struct Detector {
    session: Session,
    card: DetectorCard,
    input: String,
    output: String,
}

impl Detector {
    /// Checks that a network matches its card, and runs it once on a grey picture.
    ///
    /// # Errors
    ///
    /// Fails with [`FitError`], with the names and dimensions on the card and in the network.
    pub fn new(session: Session, card: DetectorCard) -> Result<Self, FitError> {
        let description = session.description();
        let input = input_of(&card.input, &description.inputs)?;
        let (name, key) = match &card.output {
            Boxes::Yolox { grids, .. } => (grids.clone(), "output.grids"),
            Boxes::Centres { boxes, .. } => (boxes.clone(), "output.boxes"),
            Boxes::List { boxes } => (Some(boxes.clone()), "output.boxes"),
        };
        let output = only(name.as_ref(), &description.outputs, key)?;
        let detector = Self {
            session,
            card,
            input,
            output,
        };
        detector.run(&vec![0.0; detector.n_values()])?;
        Ok(detector)
    }

    /// The detector's card.
    pub fn card(&self) -> &DetectorCard {
        &self.card
    }

    fn n_values(&self) -> usize {
        3 * self.card.input.width * self.card.input.height
    }

    /// Returns the people in a picture, the most certain first, with outlines in pixels of the picture.
    ///
    /// * `values`: memory that is reused from picture to picture.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError`], also if the output contains a value that is not finite.
    pub fn people(
        &self,
        image: Rgb8View<'_>,
        values: &mut Vec<f32>,
    ) -> Result<Vec<PersonBox>, LookError> {
        values.resize(self.n_values(), 0.0);
        let size = [image.width(), image.height()];
        let step = self.card.fill(image.data(), size, values);
        let mut found = self.run(values)?;
        for it in &mut found {
            // A pixel of the input covers `step` pixels of the picture.
            it.outline = it.outline.map(|side| (side + 0.5) * step - 0.5);
        }
        Ok(found)
    }

    fn run(&self, values: &[f32]) -> Result<Vec<PersonBox>, LookError> {
        let [width, height] = [self.card.input.width, self.card.input.height];
        let shape = match self.card.input.layout {
            Layout::Planes => [1, 3, height, width],
            Layout::Pixels => [1, height, width, 3],
        };
        let (mut whole, mut bytes) = (Vec::new(), Vec::new());
        let numbers = self.card.input.numbers;
        let input = Input {
            name: &self.input,
            shape: &shape,
            values: as_taken(numbers, values, (&mut whole, &mut bytes)),
        };
        let name = || self.output.clone();
        let mut found = Err(LookError::Type { name: name() });
        self.session.run(&[input], &[&self.output], &mut |output| {
            if let Some(values) = output.values {
                let read = self.card.boxes(values, output.shape);
                found = read.map_err(|error| LookError::Output {
                    name: name(),
                    error,
                });
            }
        })?;
        found
    }
}
