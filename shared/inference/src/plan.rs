//! The operations of a front with their memory, which is reused from picture to picture.

use std::sync::{Mutex, PoisonError};

use kernels::{Blocked, BlockedShape, Conv, Isa, Outputs, Scratch, add_repeated};

use crate::front::{Front, Operation, Value};

/// The steps of a run, and the memory blocks that these steps read and write.
#[derive(Debug)]
pub(crate) struct Plan {
    isa: Isa,
    steps: Vec<Step>,
    /// Shapes of the memory blocks; the first is the input.
    places: Vec<BlockedShape>,
    exits: Vec<Exit>,
    /// Memory of earlier runs, to be used again. There may be several, because several threads may run the front at the same time.
    spare: Mutex<Vec<Memory>>,
}

/// An output of the front, in the order of `Front::exits`.
#[derive(Debug)]
struct Exit {
    place: usize,
    shape: [usize; 4],
}

#[derive(Debug)]
struct Step {
    work: Work,
    /// Indices of two blocks: one with the unchanged values, and one with negative values replaced by zero.
    outputs: [Option<usize>; 2],
}

#[derive(Debug)]
enum Work {
    Conv {
        conv: Box<Conv>,
        input: usize,
        residual: Option<usize>,
    },
    Sum {
        places: [usize; 2],
        repeat: usize,
    },
}

/// The memory of a run.
#[derive(Debug)]
struct Memory {
    /// Memory blocks; `None` while a block is written.
    places: Vec<Option<Blocked>>,
    exits: Vec<Vec<f32>>,
    scratch: Scratch,
}

/// State while memory blocks are assigned.
struct Places {
    shapes: Vec<BlockedShape>,
    free: Vec<usize>,
    /// For each stack of channels, the indices of two blocks: one with the unchanged values, and one with negative values replaced by zero.
    of_stacks: Vec<[Option<usize>; 2]>,
    /// Number of steps that have yet to read each of these blocks.
    readers: Vec<[usize; 2]>,
}

impl Places {
    fn find(&mut self, shape: BlockedShape) -> usize {
        let free = self.free.iter().position(|place| self.shapes[*place] == shape);
        free.map_or_else(
            || {
                self.shapes.push(shape);
                self.shapes.len() - 1
            },
            |at| self.free.swap_remove(at),
        )
    }

    fn at(&self, value: Value) -> usize {
        self.of_stacks[value.stack][usize::from(value.is_relu)].unwrap_or_default()
    }

    /// Counts down the readers of a value, and frees its block after the last one.
    fn leave(&mut self, value: Value) {
        let readers = &mut self.readers[value.stack][usize::from(value.is_relu)];
        *readers -= 1;
        if *readers == 0 && value.stack > 0 {
            self.free.push(self.at(value));
        }
    }
}

impl Plan {
    pub(crate) fn new(front: Front, isa: Isa) -> Self {
        let border = front.border;
        let shape = |sides| BlockedShape::new(sides, border);
        let mut places = Places {
            shapes: vec![BlockedShape::packed(front.sides[0], border)],
            free: Vec::new(),
            of_stacks: vec![[None; 2]; front.sides.len()],
            readers: vec![[0; 2]; front.sides.len()],
        };
        places.of_stacks[0] = [Some(0); 2];
        let taken = front.operations.iter().flat_map(Operation::takes);
        for value in taken.chain(front.exits.iter().map(|exit| exit.value)) {
            places.readers[value.stack][usize::from(value.is_relu)] += 1;
        }
        let mut steps = Vec::new();
        for (stack, operation) in front.operations.into_iter().enumerate() {
            let takes = operation.takes();
            let outputs = [0, 1].map(|form| {
                let is_read = stack > 0 && places.readers[stack][form] > 0;
                is_read.then(|| places.find(shape(front.sides[stack])))
            });
            let work = match operation {
                Operation::Input | Operation::Nothing => continue,
                Operation::Conv {
                    conv,
                    input,
                    residual,
                } => Work::Conv {
                    conv: Box::new(conv),
                    input: places.at(input),
                    residual: residual.map(|value| places.at(value)),
                },
                Operation::Sum { of, repeat } => Work::Sum {
                    places: of.map(|value| places.at(value)),
                    repeat,
                },
            };
            places.of_stacks[stack] = outputs;
            for value in takes {
                places.leave(value);
            }
            steps.push(Step { work, outputs });
        }
        let exits = front.exits.iter().map(|exit| {
            let [channels, rows, cols] = front.sides[exit.value.stack];
            Exit {
                place: places.at(exit.value),
                shape: [1, channels, rows, cols],
            }
        });
        Self {
            isa,
            steps,
            exits: exits.collect(),
            places: places.shapes,
            spare: Mutex::new(Vec::new()),
        }
    }

    /// Channels, rows and columns of the input.
    pub(crate) fn input(&self) -> [usize; 3] {
        self.places[0].sides()
    }

    /// Runs the front on a picture, given channel by channel and row by row, and passes the shapes and values of its outputs to the caller.
    pub(crate) fn run<T>(
        &self,
        picture: &[f32],
        then: impl FnOnce(&[([usize; 4], &[f32])]) -> T,
    ) -> T {
        let spare = || self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let memory = spare().pop();
        let mut memory = memory.unwrap_or_else(|| Memory {
            places: self.places.iter().map(|shape| Some(Blocked::new(*shape))).collect(),
            exits: vec![Vec::new(); self.exits.len()],
            scratch: Scratch::default(),
        });
        if let Some(input) = &mut memory.places[0] {
            input.fill(picture);
        }
        for step in &self.steps {
            self.step(step, &mut memory);
        }
        for (exit, to) in self.exits.iter().zip(&mut memory.exits) {
            if let Some(from) = &memory.places[exit.place] {
                from.write(to);
            }
        }
        let exits = self.exits.iter().zip(&memory.exits);
        let exits: Vec<_> = exits.map(|(exit, values)| (exit.shape, &values[..])).collect();
        let result = then(&exits);
        spare().push(memory);
        result
    }

    fn step(
        &self,
        step: &Step,
        Memory {
            places, scratch, ..
        }: &mut Memory,
    ) {
        let [mut raw, mut relu] = step.outputs.map(|place| places[place?].take());
        let outputs = Outputs {
            raw: raw.as_mut(),
            relu: relu.as_mut(),
        };
        match &step.work {
            Work::Conv {
                conv,
                input,
                residual,
            } => {
                let residual = residual.and_then(|place| places[place].as_ref());
                if let Some(input) = &places[*input] {
                    conv.run(self.isa, (input, residual), outputs, scratch);
                }
            }
            Work::Sum { places: of, repeat } => {
                if let [Some(a), Some(b)] = of.map(|place| places[place].as_ref()) {
                    add_repeated(self.isa, a, b, *repeat, outputs);
                }
            }
        }
        for (place, stack) in step.outputs.into_iter().zip([raw, relu]) {
            if let Some(place) = place {
                places[place] = stack;
            }
        }
    }
}
