//! ONNX Runtime, a library that the user provides. It is used for networks that `rten` cannot run, and for GPUs.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ort::environment::Environment;
use ort::session::{Session, SessionInputValue};
use ort::value::{TensorRef, ValueType};

use crate::Values;
use crate::engine::{Description, Engine, EngineError, Input, LoadError, Output, Port, Side};
use crate::provider::{Place, Provider};

/// The library loaded by this process. Only one can be loaded, and it stays loaded.
static LOADED: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);

/// The loaded library, and the device on which it runs networks.
#[derive(Debug)]
pub struct OnnxRuntime {
    environment: Environment,
    provider: Provider,
}

impl OnnxRuntime {
    /// Loads the library, once in a process. It runs networks on one thread of the processor.
    ///
    /// * `library`: path of the library file, for example `/usr/lib/libonnxruntime.so`; ONNX Runtime 1.17 or newer.
    ///
    /// # Errors
    ///
    /// Fails with [`LoadError::Library`] if the file cannot be loaded or is too old, or if another library has been loaded before.
    pub fn load(library: &Path) -> Result<Self, LoadError> {
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let environment = match &*loaded {
            Some((file, environment)) if file == library => environment.clone(),
            Some((file, _)) => {
                let [wanted, has] = [library, file].map(Path::display);
                let message = format!("{wanted} cannot be loaded, because {has} is already in use");
                return Err(LoadError::Library(message.into()));
            }
            None => {
                let environment = begin(library).map_err(LoadError::Library)?;
                *loaded = Some((library.to_owned(), environment.clone()));
                environment
            }
        };
        Ok(Self {
            environment,
            provider: Provider::Processor,
        })
    }

    /// Selects the device on which networks run.
    #[must_use]
    pub fn on(self, provider: Provider) -> Self {
        Self { provider, ..self }
    }

    /// Loads a network. Also returns the device on which the network runs.
    pub(crate) fn load_network(
        &self,
        file: &[u8],
    ) -> Result<(Loaded, Description, Place), LoadError> {
        let on_cuda = self.provider.is_cuda().then(|| self.session(file, true));
        let place = match &on_cuda {
            None => Place::Processor,
            Some(Ok(_)) => Place::Cuda,
            Some(Err(error)) => Place::ProcessorForCuda(error.to_string()),
        };
        let session = match on_cuda {
            Some(Ok(session)) => session,
            Some(Err(error)) if self.provider == Provider::Cuda => {
                return Err(LoadError::Cuda(error));
            }
            Some(Err(_)) | None => self.session(file, false).map_err(LoadError::File)?,
        };
        let description = described(&session).map_err(LoadError::File)?;
        Ok((Loaded(Mutex::new(session)), description, place))
    }

    fn session(&self, file: &[u8], on_cuda: bool) -> Result<Session, EngineError> {
        let builder = Session::builder(&self.environment)?;
        let builder = builder.with_intra_threads(1).map_err(|error| plain(&error))?;
        let builder = builder.with_inter_threads(1).map_err(|error| plain(&error))?;
        let mut builder = if on_cuda {
            let cuda = ort::ep::CUDA::default().build().error_on_failure();
            builder.with_execution_providers([cuda]).map_err(|error| plain(&error))?
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

/// The same error, without its recovery value.
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
    let port = |outlet: &ort::value::Outlet| Port {
        name: outlet.name().to_owned(),
        sides: sides(outlet.dtype()),
    };
    Ok(Description {
        metadata: entries.collect(),
        inputs: session.inputs().iter().map(port).collect(),
        outputs: session.outputs().iter().map(port).collect(),
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
    shape.iter().zip(dimension_symbols.iter()).map(side).collect()
}

/// A network loaded by the library. It runs for one caller at a time.
#[derive(Debug)]
pub(crate) struct Loaded(Mutex<Session>);

impl Engine for Loaded {
    fn run(
        &self,
        inputs: &[Input<'_>],
        outputs: &[&str],
        take: &mut dyn FnMut(Output<'_>),
    ) -> Result<(), EngineError> {
        let mut given: Vec<(&str, SessionInputValue<'_>)> = Vec::with_capacity(inputs.len());
        for input in inputs {
            let shape = input.shape.to_vec();
            given.push((
                input.name,
                match input.values {
                    Values::F32(values) => TensorRef::from_array_view((shape, values))?.into(),
                    Values::I32(values) => TensorRef::from_array_view((shape, values))?.into(),
                    Values::U8(values) => TensorRef::from_array_view((shape, values))?.into(),
                },
            ));
        }
        let mut session = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = session.run(given)?;
        for (index, name) in outputs.iter().enumerate() {
            let value = found.get(*name);
            let value = value.ok_or_else(|| format!("the network has no output `{name}`"))?;
            let sides = match value.dtype() {
                ValueType::Tensor { shape, .. } => {
                    shape.iter().map(|&shape| usize::try_from(shape))
                }
                _ => return Err(format!("the output `{name}` is not a tensor").into()),
            };
            let shape: Vec<usize> = sides.collect::<Result<_, _>>()?;
            let values = value.try_extract_tensor::<f32>().ok();
            take(Output {
                index,
                shape: &shape,
                values: values.map(|value| value.1),
            });
        }
        Ok(())
    }
}
