//! Parallax's own engine: `kernels` computes the convolutions, and `rten` the later layers.

use kernels::Isa;

use crate::Values;
use crate::engine::{Engine, EngineError, Input, Output};
use crate::front::{Front, NoFront};
use crate::plan::Plan;
use crate::rest::rest;
use crate::rten_engine::Rten;
use crate::source::Source;

/// A network split into two parts: its front, which `kernels` runs, and the rest.
#[derive(Debug)]
pub(crate) struct Parts {
    input: String,
    plan: Plan,
    /// Names of the outputs of the first part.
    exits: Vec<String>,
    rest: Option<Rten>,
}

/// A network split into two parts. It is also kept as a whole, for inputs of other shapes.
#[derive(Debug)]
pub(crate) struct Direct {
    pub(crate) parts: Parts,
    pub(crate) whole: Rten,
}

impl Parts {
    /// Splits a network into the convolutions run by Parallax and the rest.
    pub(crate) fn find(file: &[u8]) -> Result<Self, NoFront> {
        let isa = Isa::best();
        if isa.is_portable() {
            return Err(NoFront::Machine);
        }
        let source = Source::read(file).ok_or(NoFront::Input)?;
        let front = Front::find(&source)?;
        let input = source.input().ok_or(NoFront::Input)?.0.to_owned();
        let rest = rest(file, &source, &front).map(Rten::load).transpose();
        let rest = rest.map_err(|error| NoFront::Rest(error.to_string()))?;
        Ok(Self {
            input,
            exits: front.exits.iter().map(|exit| exit.name.clone()).collect(),
            plan: Plan::new(front, isa),
            rest: rest.map(|rest| rest.0),
        })
    }
}

impl Engine for Direct {
    fn run(
        &self,
        inputs: &[Input<'_>],
        outputs: &[&str],
        take: &mut dyn FnMut(Output<'_>),
    ) -> Result<(), EngineError> {
        let Parts {
            input: expected,
            plan,
            exits: names,
            rest,
        } = &self.parts;
        let [channels, rows, cols] = plan.input();
        let &[
            input @ Input {
                name,
                shape,
                values: Values::F32(values),
            },
        ] = inputs
        else {
            return self.whole.run(inputs, outputs, take);
        };
        let n = channels * rows * cols;
        if name != expected || shape != [1, channels, rows, cols] || values.len() != n {
            return self.whole.run(inputs, outputs, take);
        }
        plan.run(values, |exits| {
            let mut behind = Vec::with_capacity(outputs.len());
            for (index, name) in outputs.iter().enumerate() {
                match names.iter().position(|exit| exit == name) {
                    Some(at) => take(Output {
                        index,
                        shape: &exits[at].0,
                        values: Some(exits[at].1),
                    }),
                    None => behind.push(index),
                }
            }
            let Some(rest) = rest.as_ref().filter(|_| !behind.is_empty()) else {
                return Ok(());
            };
            let given = names.iter().zip(exits).map(|(name, (shape, values))| Input {
                name,
                shape,
                values: Values::F32(values),
            });
            let given: Vec<Input<'_>> = given.chain([input]).collect();
            let wanted: Vec<&str> = behind.iter().map(|index| outputs[*index]).collect();
            rest.run(&given, &wanted, &mut |output| {
                take(Output {
                    index: behind[output.index],
                    ..output
                });
            })
        })
    }
}
