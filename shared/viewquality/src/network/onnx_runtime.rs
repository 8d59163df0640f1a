//! ONNX Runtime, a library that the user provides: for networks that `rten` cannot run, and for
//! GPUs.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ort::environment::Environment;
use ort::session::{Session, SessionInputValue};
use ort::value::{TensorRef, ValueType};

use super::NetworkError;
use super::engine::{Description, Engine, EngineError, Input, InputInfo, Output, Side};

/// The library of this process: only one can be loaded, and it stays loaded.
static LOADED: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);

/// The loaded library, and what it runs networks on.
#[derive(Debug)]
pub struct OnnxRuntime {
    environment: Environment,
    on_cuda: bool,
}

impl OnnxRuntime {
    /// Loads the library, once in a process. It runs networks on one thread of the processor.
    ///
    /// * `library`: its file, for example `/usr/lib/libonnxruntime.so`; ONNX Runtime 1.17 or newer.
    ///
    /// # Errors
    ///
    /// [`NetworkError::Library`] if it cannot be loaded or is too old, or if another one has been loaded before.
    pub fn load(library: &Path) -> Result<Self, NetworkError> {
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let environment = match &*loaded {
            Some((file, environment)) if file == library => environment.clone(),
            Some((file, _)) => {
                let [wanted, has] = [library, file].map(Path::display);
                let message = format!("{wanted} cannot be loaded, {has} is already in use");
                return Err(NetworkError::Library(message.into()));
            }
            None => {
                let environment = begin(library).map_err(NetworkError::Library)?;
                *loaded = Some((library.to_owned(), environment.clone()));
                environment
            }
        };
        Ok(Self {
            environment,
            on_cuda: false,
        })
    }

    /// Runs networks on the first GPU of NVIDIA's, which the library must have been built for: else no network can be
    /// loaded.
    #[must_use]
    pub fn on_cuda(self) -> Self {
        Self {
            on_cuda: true,
            ..self
        }
    }

    pub(super) fn load_network(&self, file: &[u8]) -> Result<(Loaded, Description), NetworkError> {
        let session = self.session(file).map_err(NetworkError::Load)?;
        let description = described(&session).map_err(NetworkError::Load)?;
        Ok((Loaded(Mutex::new(session)), description))
    }

    fn session(&self, file: &[u8]) -> Result<Session, EngineError> {
        let builder = Session::builder(&self.environment)?;
        let builder = builder
            .with_intra_threads(1)
            .map_err(|error| plain(&error))?;
        let builder = builder
            .with_inter_threads(1)
            .map_err(|error| plain(&error))?;
        let mut builder = if self.on_cuda {
            let cuda = ort::ep::CUDA::default().build().error_on_failure();
            builder
                .with_execution_providers([cuda])
                .map_err(|error| plain(&error))?
        } else {
            builder
        };
        Ok(builder.commit_from_memory(file)?)
    }
}

fn begin(library: &Path) -> Result<Environment, EngineError> {
    let builder = ort::init_from(library).map_err(|error| error.to_string())?;
    Ok(builder.with_telemetry(false).build()?)
}

/// The error without its recovery value.
fn plain<T>(error: &ort::Error<T>) -> EngineError {
    error.to_string().into()
}

fn described(session: &Session) -> Result<Description, EngineError> {
    let metadata = session.metadata()?;
    let keys = metadata.custom_keys()?.into_iter();
    let entries = keys.filter_map(|key| {
        let value = metadata.custom(&key)?;
        Some((key, value))
    });
    let port = |outlet: &ort::value::Outlet| InputInfo {
        name: outlet.name().to_owned(),
        sides: sides(outlet.dtype()),
    };
    Ok(Description {
        metadata: entries.collect(),
        inputs: session.inputs().iter().map(port).collect(),
        outputs: session
            .outputs()
            .iter()
            .map(|outlet| outlet.name().to_owned())
            .collect(),
    })
}

fn sides(of: &ValueType) -> Vec<Side> {
    let ValueType::Tensor {
        shape,
        dimension_symbols,
        ..
    } = of
    else {
        return Vec::new();
    };
    let side = |(&size, name): (&i64, &String)| {
        usize::try_from(size).map_or_else(|_| Side::Named(name.clone()), Side::Fixed)
    };
    shape
        .iter()
        .zip(dimension_symbols.iter())
        .map(side)
        .collect()
}

/// A network loaded by the library; it runs for one caller at a time.
#[derive(Debug)]
pub(super) struct Loaded(Mutex<Session>);

impl Engine for Loaded {
    fn run(&self, inputs: &[Input<'_>], output: &str) -> Result<Option<Output>, EngineError> {
        let mut given: Vec<(&str, SessionInputValue<'_>)> = Vec::with_capacity(inputs.len());
        for input in inputs {
            let tensor = TensorRef::from_array_view((input.shape.clone(), input.values))?;
            given.push((input.name, tensor.into()));
        }
        let mut session = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let outputs = session.run(given)?;
        let value = outputs.get(output);
        let value = value.ok_or_else(|| format!("the network has no output `{output}`"))?;
        let Ok((shape, values)) = value.try_extract_tensor::<f32>() else {
            return Ok(None);
        };
        let sides = shape.iter().map(|&it| usize::try_from(it));
        Ok(Some((sides.collect::<Result<_, _>>()?, values.to_vec())))
    }
}
