//! A network with its card: a picture and a box in, keypoints and maps out.

mod taken;

pub(crate) use taken::as_taken;

use inference::{Input, Port, RunError, Session, written};
use kernels::Rgb8View;
use keypoints::{Card, Codec, HeatMaps, Keypoint, Layout, List, OutputError, SimCc, Window};

/// A network that fits its card.
#[derive(Debug)]
pub struct PoseNetwork {
    session: Session,
    card: Card,
    names: Vec<String>,
    input: String,
    outputs: Vec<String>,
}

/// Why a network does not fit its card.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// Names on the card are not those of the network.
    #[error("the card names the {what} `{wanted}`, but the network has {has}")]
    Name {
        /// `input` or `output`.
        what: &'static str,
        /// The name on the card.
        wanted: String,
        /// The names in the file.
        has: String,
    },
    /// There are several, and the card does not say which one is meant.
    #[error("the network has the {what}s {has}: the card must name one (`{key}`)")]
    Several {
        /// `input` or `output`.
        what: &'static str,
        /// The names in the file.
        has: String,
        /// The key of the card.
        key: &'static str,
    },
    /// The input has other sides.
    #[error("the input `{name}` of the network is {got}, but the card says {expected}")]
    InputShape {
        /// Its name.
        name: String,
        /// Its sides in the file.
        got: String,
        /// Its sides by the card.
        expected: String,
    },
    /// It could not be tried.
    #[error(transparent)]
    Look(#[from] LookError),
}

/// Why a network says nothing about a picture.
#[derive(Debug, thiserror::Error)]
pub enum LookError {
    /// The library could not run it.
    #[error(transparent)]
    Run(#[from] RunError),
    /// An output is not what the card says.
    #[error("output `{name}`: {error}")]
    Output {
        /// Its name.
        name: String,
        /// What is wrong.
        error: OutputError,
    },
    /// An output does not consist of numbers in single precision.
    #[error("output `{name}` is not of type f32")]
    Type {
        /// Its name.
        name: String,
    },
}

/// Memory that is used again from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    values: Vec<f32>,
    whole: Vec<i32>,
    bytes: Vec<u8>,
    outputs: Vec<Tensor>,
}

/// An output.
#[derive(Debug, Clone, Default)]
struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
    is_f32: bool,
}

/// What a network sees in a window of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    network: &'a PoseNetwork,
    window: Window,
    outputs: &'a [Tensor],
}

/// The output of a network, read as its card says.
#[derive(Debug, Clone, Copy)]
pub enum Read<'a> {
    /// Maps.
    Maps(HeatMaps<'a>),
    /// Distributions over columns and rows.
    SimCc(SimCc<'a>),
    /// Positions.
    List(List<'a>),
}

impl PoseNetwork {
    /// Checks that a network fits its card, and runs it once on zeros.
    ///
    /// # Errors
    ///
    /// [`FitError`], with the names and sides of both.
    pub fn new(session: Session, card: Card) -> Result<Self, FitError> {
        let description = session.description();
        let input = input_of(&card.input, &description.inputs)?;
        let outputs = outputs_of(&card, &description.outputs)?;
        let network = Self {
            names: card.names(),
            session,
            card,
            input,
            outputs,
        };
        let mut workspace = Workspace::default();
        workspace.values.resize(network.n_values(), 0.0);
        let [width, height] = network.size().map(|it| it as f64);
        if let Some(window) = Window::new(&network.card, [0.0, 0.0, width, height]) {
            network.run(window, &mut workspace)?;
        }
        Ok(network)
    }

    /// Its card.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// The names of its keypoints, in the order of its output.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The loaded network.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Width and height of its input, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.card.input.width, self.card.input.height]
    }

    fn n_values(&self) -> usize {
        let [width, height] = self.size();
        3 * width * height
    }

    /// Looks at the person in a box.
    ///
    /// * `outline`: left, top, right, bottom, pixels of the picture.
    /// * Returns `None` for a box without an extent.
    ///
    /// # Errors
    ///
    /// [`LookError`]; also if the output holds a value that is not finite.
    pub fn look<'a>(
        &'a self,
        image: Rgb8View<'_>,
        outline: [f64; 4],
        workspace: &'a mut Workspace,
    ) -> Result<Option<Sight<'a>>, LookError> {
        let Some(window) = Window::new(&self.card, outline) else {
            return Ok(None);
        };
        workspace.values.resize(self.n_values(), 0.0);
        let size = [image.width(), image.height()];
        window.fill(&self.card, image.data(), size, &mut workspace.values);
        self.run(window, workspace).map(Some)
    }

    fn run<'a>(
        &'a self,
        window: Window,
        workspace: &'a mut Workspace,
    ) -> Result<Sight<'a>, LookError> {
        let [width, height] = self.size();
        let shape = match self.card.input.layout {
            Layout::Planes => [1, 3, height, width],
            Layout::Pixels => [1, height, width, 3],
        };
        let Workspace {
            values,
            whole,
            bytes,
            outputs,
        } = workspace;
        let values = as_taken(self.card.input.numbers, values, (whole, bytes));
        let input = Input {
            name: &self.input,
            shape: &shape,
            values,
        };
        outputs.resize(self.outputs.len(), Tensor::default());
        let wanted: Vec<&str> = self.outputs.iter().map(String::as_str).collect();
        self.session.run(&[input], &wanted, &mut |output| {
            let held = &mut outputs[output.index];
            held.shape.clear();
            held.shape.extend_from_slice(output.shape);
            held.values.clear();
            held.is_f32 = output.values.is_some();
            held.values
                .extend_from_slice(output.values.unwrap_or_default());
        })?;
        let outputs = &*outputs;
        if let Some(at) = outputs.iter().position(|it| !it.is_f32) {
            let name = self.outputs[at].clone();
            return Err(LookError::Type { name });
        }
        let sight = Sight {
            network: self,
            window,
            outputs,
        };
        sight.read()?;
        sight.check_also()?;
        Ok(sight)
    }
}

impl<'a> Sight<'a> {
    /// The network.
    pub fn network(&self) -> &'a PoseNetwork {
        self.network
    }

    /// Where the input lay in the picture.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// The window in which a cell of the maps lies at its number times their step, as [`HeatMaps::step`] has it. That is
    /// [`Self::window`] where the first cell lies on the first pixel, and half a cell from there where every cell lies in the
    /// middle of the pixels that it covers.
    ///
    /// # Errors
    ///
    /// As [`Self::read`].
    pub fn maps_window(&self) -> Result<Window, LookError> {
        let by = match (self.read()?, &self.network.card.output) {
            (
                Read::Maps(maps),
                Codec::HeatMap {
                    udp, centred: true, ..
                },
            ) => {
                let cell = maps.step(self.network.size(), *udp);
                let step = self.window.step();
                [0, 1].map(|axis| 0.5 * (cell[axis] - 1.0) * step[axis])
            }
            _ => [0.0; 2],
        };
        Ok(self.window.shifted(by))
    }

    /// The output, read as the card says.
    ///
    /// # Errors
    ///
    /// [`LookError::Output`]; never, once the network has looked.
    pub fn read(&self) -> Result<Read<'a>, LookError> {
        let card = &self.network.card;
        let n = self.network.names.len();
        let [width, height] = self.network.size();
        let first = &self.outputs[0];
        let read = match &card.output {
            Codec::HeatMap {
                layout, further, ..
            } => {
                let n = [n, *further];
                HeatMaps::new(&first.values, &first.shape, *layout, n).map(Read::Maps)
            }
            Codec::Simcc { bins_per_pixel, .. } => {
                let rows = &self.outputs[1];
                let bins = [width, height].map(|it| (it as f64 * bins_per_pixel).round() as usize);
                let values = [&first.values[..], &rows.values[..]];
                SimCc::new(values, [&first.shape, &rows.shape], bins, n).map(Read::SimCc)
            }
            Codec::Keypoints { fields, .. } => {
                List::new(&first.values, &first.shape, fields, n).map(Read::List)
            }
        };
        read.map_err(|error| LookError::Output {
            name: self.network.outputs.join("`, `"),
            error,
        })
    }

    /// What it tells of the direction in which the trunk faces: towards the right of the picture, towards the camera; `None` if it
    /// tells nothing of it. See [`keypoints::Also::front`].
    pub fn front(&self) -> Option<[f32; 2]> {
        let at = self.also(self.network.card.also.front.as_deref())?;
        at.values.as_slice().try_into().ok()
    }

    /// The expected error of every keypoint, pixels of the picture, in the order of the card's names; `None` if it tells nothing of
    /// it.
    pub fn errors(&self) -> Option<impl Iterator<Item = f64>> {
        let [_, height] = self.network.size();
        let height = height as f64 * self.window.step()[1];
        let errors = &self.also(self.network.card.also.error.as_deref())?.values;
        Some(errors.iter().map(move |it| f64::from(*it) * height))
    }

    fn also(&self, name: Option<&str>) -> Option<&'a Tensor> {
        let name = name?;
        let names = self.network.outputs.iter().zip(self.outputs);
        // Behind those of the codec.
        names.rev().find(|it| it.0.as_str() == name).map(|it| it.1)
    }

    /// Whether what it tells beside the keypoints has the shape that the card says, and is finite.
    fn check_also(&self) -> Result<(), LookError> {
        let also = &self.network.card.also;
        for (name, n) in [(&also.front, 2), (&also.error, self.network.names.len())] {
            let Some(output) = self.also(name.as_deref()) else {
                continue;
            };
            let name = || name.clone().unwrap_or_default();
            if output.values.len() != n {
                let (got, expected) = (output.shape.clone(), vec![1, n]);
                let error = OutputError::Shape {
                    got,
                    expected: format!("{expected:?}"),
                };
                return Err(LookError::Output {
                    name: name(),
                    error,
                });
            }
            if let Some(at) = output.values.iter().position(|it| !it.is_finite()) {
                let error = OutputError::NotANumber {
                    index: at,
                    value: output.values[at],
                };
                return Err(LookError::Output {
                    name: name(),
                    error,
                });
            }
        }
        Ok(())
    }

    /// The keypoints, in pixels of the picture, in the order of the card's names.
    ///
    /// # Errors
    ///
    /// As [`Self::read`].
    pub fn keypoints(&self) -> Result<Vec<Keypoint>, LookError> {
        let size = self.network.size();
        let mut found = match (self.read()?, &self.network.card.output) {
            (
                Read::Maps(maps),
                Codec::HeatMap {
                    udp, refine, score, ..
                },
            ) => maps.keypoints(size, *udp, *refine, *score),
            (Read::SimCc(simcc), Codec::Simcc { bins_per_pixel, .. }) => {
                simcc.keypoints(*bins_per_pixel)
            }
            (Read::List(list), Codec::Keypoints { unit, score, .. }) => {
                list.keypoints(size, *unit, *score)
            }
            _ => Vec::new(),
        };
        let window = self.maps_window()?;
        for it in &mut found {
            it.at = window.in_picture(it.at);
        }
        Ok(found)
    }
}

fn listed(ports: &[Port]) -> String {
    let names: Vec<String> = ports
        .iter()
        .map(|it| format!("`{}` {}", it.name, written(&it.sides)))
        .collect();
    names.join(", ")
}

/// The name of the input, checked against the card.
pub(crate) fn input_of(input_card: &keypoints::Input, inputs: &[Port]) -> Result<String, FitError> {
    let input = match (&input_card.name, inputs) {
        (Some(name), _) => {
            inputs
                .iter()
                .find(|it| it.name == *name)
                .ok_or_else(|| FitError::Name {
                    what: "input",
                    wanted: name.clone(),
                    has: listed(inputs),
                })?
        }
        (None, [input]) => input,
        (None, _) => {
            return Err(FitError::Several {
                what: "input",
                has: listed(inputs),
                key: "input.name",
            });
        }
    };
    let keypoints::Input {
        width,
        height,
        layout,
        ..
    } = input_card;
    let expected = match layout {
        Layout::Planes => [1, 3, *height, *width],
        Layout::Pixels => [1, *height, *width, 3],
    };
    let sides = &input.sides;
    let fits = sides.len() == 4 && sides.iter().zip(expected).all(|(side, n)| side.may_be(n));
    if !sides.is_empty() && !fits {
        return Err(FitError::InputShape {
            name: input.name.clone(),
            got: written(sides),
            expected: format!("{expected:?}"),
        });
    }
    Ok(input.name.clone())
}

/// The names of the outputs that the codec reads, and of those beside them.
fn outputs_of(card: &Card, outputs: &[Port]) -> Result<Vec<String>, FitError> {
    let mut names = outputs_of_codec(card, outputs)?;
    let also = [
        (&card.also.front, "also.front"),
        (&card.also.error, "also.error"),
    ];
    for (name, key) in also {
        if name.is_some() {
            names.push(only(name.as_ref(), outputs, key)?);
        }
    }
    Ok(names)
}

fn outputs_of_codec(card: &Card, outputs: &[Port]) -> Result<Vec<String>, FitError> {
    match &card.output {
        Codec::HeatMap { maps, .. } => Ok(vec![only(maps.as_ref(), outputs, "output.maps")?]),
        Codec::Simcc { x, y, .. } => Ok(vec![
            only(Some(x), outputs, "output.x")?,
            only(Some(y), outputs, "output.y")?,
        ]),
        Codec::Keypoints { list, .. } => Ok(vec![only(list.as_ref(), outputs, "output.list")?]),
    }
}

/// The output of a name, or the only one.
pub(crate) fn only(
    name: Option<&String>,
    outputs: &[Port],
    key: &'static str,
) -> Result<String, FitError> {
    match (name, outputs) {
        (Some(name), _) if outputs.iter().any(|it| it.name == *name) => Ok(name.clone()),
        (Some(name), _) => Err(FitError::Name {
            what: "output",
            wanted: name.clone(),
            has: listed(outputs),
        }),
        (None, [output]) => Ok(output.name.clone()),
        (None, _) => Err(FitError::Several {
            what: "output",
            has: listed(outputs),
            key,
        }),
    }
}

#[cfg(test)]
mod tests;
