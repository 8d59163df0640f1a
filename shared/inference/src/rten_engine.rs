//! The built-in library `rten`.

use std::sync::Arc;

use rten::{Dimension, Model, NodeId, RunOptions, ThreadPool, Value, ValueOrView};
use rten_tensor::TensorView;
use rten_tensor::prelude::*;

use crate::Values;
use crate::engine::{Description, Engine, EngineError, Input, LoadError, Output, Port, Side};

/// A network and the thread on which it runs.
#[derive(Debug)]
pub(crate) struct Rten {
    model: Model,
    threads: Arc<ThreadPool>,
}

impl Rten {
    /// * `file`: the bytes of an ONNX file.
    pub(crate) fn load(file: Vec<u8>) -> Result<(Self, Description), LoadError> {
        let model = Model::load(file).map_err(|error| LoadError::File(Box::new(error)))?;
        let metadata = model.metadata().fields();
        let metadata = metadata.map(|(name, value)| (name.to_owned(), value.to_owned()));
        let ports = |ids: &[NodeId]| ids.iter().map(|&id| port(&model, id)).collect();
        let description = Description {
            metadata: metadata.collect(),
            inputs: ports(model.input_ids()),
            outputs: ports(model.output_ids()),
        };
        let threads = Arc::new(ThreadPool::with_num_threads(1));
        Ok((Self { model, threads }, description))
    }

    fn id(&self, ids: &[NodeId], wanted: &str) -> Result<NodeId, EngineError> {
        let mut ids = ids.iter().rev();
        let id = ids.find(|id| name(&self.model, **id) == wanted);
        id.copied().ok_or_else(|| format!("the network has no `{wanted}`").into())
    }
}

impl Engine for Rten {
    fn run(
        &self,
        inputs: &[Input<'_>],
        outputs: &[&str],
        take: &mut dyn FnMut(Output<'_>),
    ) -> Result<(), EngineError> {
        let mut given: Vec<(NodeId, ValueOrView<'_>)> = Vec::with_capacity(inputs.len());
        for input in inputs {
            let id = self.id(self.model.input_ids(), input.name)?;
            given.push((
                id,
                match input.values {
                    Values::F32(values) => TensorView::from_data(input.shape, values).into(),
                    Values::I32(values) => TensorView::from_data(input.shape, values).into(),
                    Values::U8(values) => TensorView::from_data(input.shape, values).into(),
                },
            ));
        }
        let ids: Result<Vec<NodeId>, EngineError> =
            outputs.iter().map(|output| self.id(self.model.output_ids(), output)).collect();
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&self.threads)));
        let found = self.model.run(given, &ids?, Some(options))?;
        for (index, value) in found.iter().enumerate() {
            let tensor: Option<TensorView<'_, f32>> = Value::as_tensor_view(value);
            let shape = value.shape();
            let tensor = tensor.map(|tensor| tensor.to_contiguous());
            take(Output {
                index,
                shape: &shape,
                values: tensor.as_ref().map(rten_tensor::Contiguous::data),
            });
        }
        Ok(())
    }
}

fn name(model: &Model, id: NodeId) -> &str {
    let info = model.node_info(id);
    info.and_then(|info| info.name()).unwrap_or_default()
}

fn port(model: &Model, id: NodeId) -> Port {
    let sides = model.node_info(id).and_then(|info| info.shape());
    let sides = sides.unwrap_or_default().into_iter().map(|side| match side {
        Dimension::Fixed(n) => Side::Fixed(n),
        Dimension::Symbolic(name) => Side::Named(name),
    });
    Port {
        name: name(model, id).to_owned(),
        sides: sides.collect(),
    }
}
