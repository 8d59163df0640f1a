//! A network with its card. It takes a picture and a box, and returns keypoints and maps.

mod errors;
mod mirror;
mod ports;
mod taken;
mod turn;

pub use errors::{FitError, LookError};
pub(crate) use ports::{input_of, only};
pub(crate) use taken::as_taken;
pub use turn::Turn;

use inference::{Input, Session};
use kernels::Rgb8View;
use keypoints::{
    Card, Codec, HeatMaps, Keypoint, Layout, List, Numbers, OutputError, SimCc, Window,
};

use self::mirror::Mirror;
use self::ports::outputs_of;
use crate::cover::{Bar, paint};

/// A network that matches its card.
#[derive(Debug)]
pub struct PoseNetwork {
    session: Session,
    card: Card,
    names: Vec<String>,
    input: String,
    outputs: Vec<String>,
    mirror: Option<Mirror>,
}

/// Memory that is reused from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    values: Vec<f32>,
    whole: Vec<i32>,
    bytes: Vec<u8>,
    outputs: Vec<Tensor>,
    /// Outputs for the mirror image.
    mirrored: Vec<Tensor>,
    /// Buffer for the input values while they are rotated.
    turned: Vec<f32>,
    /// Bars that are painted over.
    covers: Vec<Bar>,
    /// Number of runs of the network so far.
    n_runs: u64,
}

impl Workspace {
    /// Paints over parts of the picture in all later runs. This hides known people, so that the network sees the person behind them.
    pub fn cover(&mut self, bars: &[Bar]) {
        self.covers.clear();
        self.covers.extend_from_slice(bars);
    }

    /// Returns the number of runs of the network so far.
    pub fn n_runs(&self) -> u64 {
        self.n_runs
    }
}

/// One output of the network.
#[derive(Debug, Clone, Default)]
struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
    is_f32: bool,
}

impl Tensor {
    /// Channels, rows and columns of maps; `None` if the output does not have them.
    fn map_sides(&self, layout: Layout) -> Option<[usize; 3]> {
        let sides = match (layout, &self.shape[..]) {
            (Layout::Planes, &[_, channels, rows, columns])
            | (Layout::Pixels, &[_, rows, columns, channels]) => [channels, rows, columns],
            _ => return None,
        };
        let n = sides.iter().product::<usize>();
        (n > 0 && self.values.len() == n).then_some(sides)
    }
}

/// Output of a network for a window of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    network: &'a PoseNetwork,
    window: Window,
    outputs: &'a [Tensor],
}

/// The output of a network, decoded as its card specifies.
#[derive(Debug, Clone, Copy)]
pub enum Read<'a> {
    /// One map for each keypoint.
    Maps(HeatMaps<'a>),
    /// Distributions over columns and rows.
    SimCc(SimCc<'a>),
    /// Positions of the keypoints.
    List(List<'a>),
}

impl PoseNetwork {
    /// Checks that a network matches its card, and runs it once on zeros.
    ///
    /// # Errors
    ///
    /// Fails with [`FitError`], with the names and dimensions on the card and in the network.
    pub fn new(session: Session, card: Card) -> Result<Self, FitError> {
        let description = session.description();
        let input = input_of(&card.input, &description.inputs)?;
        let outputs = outputs_of(&card, &description.outputs)?;
        let mut network = Self {
            names: card.names(),
            session,
            card,
            input,
            outputs,
            mirror: None,
        };
        let mut workspace = Workspace::default();
        workspace.values.resize(network.n_values(), 0.0);
        let [width, height] = network.size().map(|size| size as f64);
        if let Some(window) = Window::new(&network.card, [0.0, 0.0, width, height]) {
            network.try_numbers(&mut workspace)?;
            network.sight(window, &workspace)?;
        }
        Ok(network)
    }

    /// Runs the network with the number type of its card. If the library refuses this type, the other integer type is tried, and used from
    /// then on if it works. The same network may be published with bytes or with 32-bit integers as input, depending on its conversion to
    /// ONNX.
    fn try_numbers(&mut self, workspace: &mut Workspace) -> Result<(), LookError> {
        let refused = match self.run(workspace) {
            Ok(()) => return Ok(()),
            Err(refused) => refused,
        };
        let of_card = self.card.input.numbers;
        self.card.input.numbers = match of_card {
            Numbers::F32 => return Err(refused),
            Numbers::U8 => Numbers::I32,
            Numbers::I32 => Numbers::U8,
        };
        self.run(workspace).map_err(|_other| {
            self.card.input.numbers = of_card;
            refused
        })
    }

    /// Returns the same network, changed to run also on the mirror image of every window and to average both results. The result is more
    /// accurate but takes twice as long.
    ///
    /// # Errors
    ///
    /// Fails with [`FitError::Mirror`] if the network returns positions, or if a keypoint has no counterpart on the other side of the body.
    pub fn mirrored(self) -> Result<Self, FitError> {
        let mirror = Mirror::new(&self.card, &self.names).map_err(FitError::Mirror)?;
        Ok(Self {
            mirror: Some(mirror),
            ..self
        })
    }

    /// The network's card.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// The names of the keypoints, in the order of the network's output.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Width and height of the network's input, in pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.card.input.width, self.card.input.height]
    }

    /// Returns true if the network can process rotated pictures, because it returns maps or distributions.
    pub fn may_turn(&self) -> bool {
        !matches!(self.card.output, Codec::Keypoints { .. })
    }

    fn n_values(&self) -> usize {
        let [width, height] = self.size();
        3 * width * height
    }

    /// Finds the joints of the person in a box.
    ///
    /// * `outline`: left, top, right, bottom, in pixels of the picture.
    /// * Returns `None` if the box is empty.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError`], also if the output contains a value that is not finite.
    pub fn look<'a>(
        &'a self,
        image: Rgb8View<'_>,
        outline: [f64; 4],
        workspace: &'a mut Workspace,
    ) -> Result<Option<Sight<'a>>, LookError> {
        self.look_turned(image, (outline, Turn::Up), workspace)
    }

    /// Finds the joints of the person in a box, with the picture rotated by the direction of the head. The maps are rotated back to the
    /// picture. A network that [returns positions](Self::may_turn) gets the picture without rotation.
    ///
    /// * The other parameters are those of [`Self::look`].
    ///
    /// # Errors
    ///
    /// Fails like [`Self::look`].
    pub fn look_turned<'a>(
        &'a self,
        image: Rgb8View<'_>,
        (outline, turn): ([f64; 4], Turn),
        workspace: &'a mut Workspace,
    ) -> Result<Option<Sight<'a>>, LookError> {
        let turn = if self.may_turn() { turn } else { Turn::Up };
        let window = if turn.is_sideways() {
            Window::sideways(&self.card, outline)
        } else {
            Window::new(&self.card, outline)
        };
        let Some(window) = window else {
            return Ok(None);
        };
        workspace.values.resize(self.n_values(), 0.0);
        let size = [image.width(), image.height()];
        window.fill(&self.card, image.data(), size, &mut workspace.values);
        paint(
            &workspace.covers,
            &window,
            &self.card,
            &mut workspace.values,
        );
        if turn != Turn::Up {
            let Workspace { values, turned, .. } = workspace;
            turn.turn_input(&self.card, window.input(), values, turned);
        }
        self.run(workspace)?;
        if let Some(mirror) = &self.mirror {
            Mirror::flip(&self.card, &mut workspace.values);
            core::mem::swap(&mut workspace.outputs, &mut workspace.mirrored);
            self.run(workspace)?;
            core::mem::swap(&mut workspace.outputs, &mut workspace.mirrored);
            let Workspace {
                outputs, mirrored, ..
            } = workspace;
            mirror.blend(self, outputs, mirrored);
        }
        if turn != Turn::Up {
            turn.turn_back(self, &mut workspace.outputs);
        }
        self.sight(window, workspace).map(Some)
    }

    /// Runs the network on the input values of a workspace.
    fn run(&self, workspace: &mut Workspace) -> Result<(), LookError> {
        let [width, height] = self.size();
        let shape = match self.card.input.layout {
            Layout::Planes => [1, 3, height, width],
            Layout::Pixels => [1, height, width, 3],
        };
        workspace.n_runs += 1;
        let Workspace {
            values,
            whole,
            bytes,
            outputs,
            ..
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
            held.values.extend_from_slice(output.values.unwrap_or_default());
        })?;
        Ok(())
    }

    /// Checks the outputs in a workspace.
    fn sight<'a>(
        &'a self,
        window: Window,
        workspace: &'a Workspace,
    ) -> Result<Sight<'a>, LookError> {
        let outputs = &workspace.outputs[..];
        if let Some(at) = outputs.iter().position(|output| !output.is_f32) {
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
    /// The network that produced this output.
    pub fn network(&self) -> &'a PoseNetwork {
        self.network
    }

    /// The part of the picture that the input covers.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// The window in which a cell's position is its index times the step of the maps, as in [`HeatMaps::step`]. It is [`Self::window`] if
    /// the first cell is at the first pixel. It is [`Self::window`] moved by half a cell if every cell is at the centre of the pixels that
    /// it covers.
    ///
    /// # Errors
    ///
    /// Fails like [`Self::read`].
    pub fn maps_window(&self) -> Result<Window, LookError> {
        let by = match (self.read()?, &self.network.card.output) {
            (
                Read::Maps(maps),
                Codec::HeatMap {
                    udp, centred: true, ..
                },
            ) => {
                let cell = maps.step(self.window.input(), *udp);
                let step = self.window.step();
                [0, 1].map(|axis| 0.5 * (cell[axis] - 1.0) * step[axis])
            }
            _ => [0.0; 2],
        };
        Ok(self.window.shifted(by))
    }

    /// Decodes the output as the card specifies.
    ///
    /// # Errors
    ///
    /// Fails with [`LookError::Output`]; this cannot happen after the network has run successfully.
    pub fn read(&self) -> Result<Read<'a>, LookError> {
        let card = &self.network.card;
        let n = self.network.names.len();
        let [width, height] = self.window.input();
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
                let bins =
                    [width, height].map(|value| (value as f64 * bins_per_pixel).round() as usize);
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

    /// Returns the direction in which the trunk faces, as components towards the right of the picture and towards the camera. `None` if the
    /// network does not give it. See [`keypoints::Also::front`].
    pub fn front(&self) -> Option<[f32; 2]> {
        let at = self.also(self.network.card.also.front.as_deref())?;
        at.values.as_slice().try_into().ok()
    }

    /// The expected error of every keypoint, in pixels of the picture, in the order of the card's names. `None` if the network does
    /// not give it.
    pub fn errors(&self) -> Option<impl Iterator<Item = f64>> {
        let [_, height] = self.network.size();
        let height = height as f64 * self.window.step()[1];
        let errors = &self.also(self.network.card.also.error.as_deref())?.values;
        Some(errors.iter().map(move |error| f64::from(*error) * height))
    }

    fn also(&self, name: Option<&str>) -> Option<&'a Tensor> {
        let name = name?;
        let names = self.network.outputs.iter().zip(self.outputs);
        // These outputs come after the outputs that contain the keypoints.
        names.rev().find(|output| output.0.as_str() == name).map(|name| name.1)
    }

    /// Checks that the outputs other than the keypoints are finite and have the shape that the card specifies.
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
            if let Some(at) = output.values.iter().position(|value| !value.is_finite()) {
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

    /// The keypoints, in pixels of the picture and in the order of the card's names.
    ///
    /// # Errors
    ///
    /// Fails like [`Self::read`].
    pub fn keypoints(&self) -> Result<Vec<Keypoint>, LookError> {
        let size = self.window.input();
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

#[cfg(test)]
mod mirror_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod turn_tests;
