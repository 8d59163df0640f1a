//! The `rten` library, which is built in.

use std::sync::Arc;

use rten::{Dimension, Model, NodeId, RunOptions, ThreadPool, Value, ValueOrView};
use rten_tensor::TensorView;
use rten_tensor::prelude::*;

use super::NetworkError;
use super::engine::{Description, Engine, EngineError, Input, InputInfo, Output, Side};

/// A network and the thread on which it runs.
#[derive(Debug)]
pub(super) struct Rten {
    model: Model,
    threads: Arc<ThreadPool>,
}

impl Rten {
    /// * `file`: the bytes of an ONNX file.
    pub(super) fn load(file: Vec<u8>) -> Result<(Self, Description), NetworkError> {
        let model = Model::load(file).map_err(|error| NetworkError::Load(Box::new(error)))?;
        let named = |id: &NodeId| name(&model, *id).to_owned();
        let metadata = model.metadata().fields();
        let metadata = metadata.map(|(name, value)| (name.to_owned(), value.to_owned()));
        let description = Description {
            metadata: metadata.collect(),
            inputs: model
                .input_ids()
                .iter()
                .map(|&id| port(&model, id))
                .collect(),
            outputs: model.output_ids().iter().map(named).collect(),
        };
        let threads = Arc::new(ThreadPool::with_num_threads(1));
        Ok((Self { model, threads }, description))
    }

    fn id(&self, ids: &[NodeId], wanted: &str) -> Result<NodeId, EngineError> {
        let mut ids = ids.iter().rev();
        let id = ids.find(|id| name(&self.model, **id) == wanted);
        id.copied()
            .ok_or_else(|| format!("the network has no `{wanted}`").into())
    }
}

impl Engine for Rten {
    fn run(&self, inputs: &[Input<'_>], output: &str) -> Result<Option<Output>, EngineError> {
        let mut given: Vec<(NodeId, ValueOrView<'_>)> = Vec::with_capacity(inputs.len());
        for input in inputs {
            let id = self.id(self.model.input_ids(), input.name)?;
            let view = TensorView::from_data(input.shape.as_slice(), input.values);
            given.push((id, view.into()));
        }
        let id = self.id(self.model.output_ids(), output)?;
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&self.threads)));
        let outputs = self.model.run(given, &[id], Some(options))?;
        let output: Option<TensorView<'_, f32>> = outputs.first().and_then(Value::as_tensor_view);
        Ok(output.map(|tensor| (tensor.shape().to_vec(), tensor.iter().copied().collect())))
    }
}

fn name(model: &Model, id: NodeId) -> &str {
    let info = model.node_info(id);
    info.and_then(|info| info.name()).unwrap_or_default()
}

fn port(model: &Model, id: NodeId) -> InputInfo {
    let sides = model.node_info(id).and_then(|info| info.shape());
    let sides = sides.unwrap_or_default().into_iter().map(|it| match it {
        Dimension::Fixed(n) => Side::Fixed(n),
        Dimension::Symbolic(name) => Side::Named(name),
    });
    InputInfo {
        name: name(model, id).to_owned(),
        sides: sides.collect(),
    }
}
