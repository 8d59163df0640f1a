//! Lists and opens the adapters of this machine.

use core::task::{Context, Poll, Waker};

use wgpu::{Backends, DeviceType, Features, Limits};

use crate::{Adapter, Choice, Kind, OpenError};

/// Optional features of an adapter, used if available.
const WANTED: Features = Features::SHADER_F64.union(Features::PASSTHROUGH_SHADERS);

/// An opened adapter.
pub(crate) struct Opened {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) adapter: Adapter,
    pub(crate) limits: Limits,
    pub(crate) takes_spirv: bool,
}

/// The adapters of this machine, best first.
pub fn adapters() -> Vec<Adapter> {
    found().iter().map(described).collect()
}

/// Opens the best adapter.
pub(crate) fn open(choice: Choice) -> Result<Opened, OpenError> {
    let best = found().into_iter().next().ok_or(OpenError::NoAdapter)?;
    let adapter = described(&best);
    if choice == Choice::Hardware && adapter.kind == Kind::Software {
        return Err(OpenError::OnlySoftware { name: adapter.name });
    }
    let refused = |why: String| OpenError::Refused {
        name: adapter.name.clone(),
        why,
    };
    let features = best.features() & WANTED;
    if !features.contains(Features::SHADER_F64) {
        return Err(refused(
            "the adapter does not support double precision".to_owned(),
        ));
    }
    let limits = best.limits();
    let wanted = wgpu::DeviceDescriptor {
        label: None,
        required_features: features,
        required_limits: limits.clone(),
        experimental_features: wgpu::ExperimentalFeatures::disabled(),
        memory_hints: wgpu::MemoryHints::Performance,
        trace: wgpu::Trace::Off,
    };
    let (device, queue) =
        wait(best.request_device(&wanted)).map_err(|error| refused(error.to_string()))?;
    Ok(Opened {
        device,
        queue,
        adapter,
        limits,
        takes_spirv: features.contains(Features::PASSTHROUGH_SHADERS),
    })
}

/// All adapters reported by Vulkan, best first, including duplicates.
fn found() -> Vec<wgpu::Adapter> {
    let mut wanted = wgpu::InstanceDescriptor::new_without_display_handle();
    wanted.backends = Backends::VULKAN;
    let instance = wgpu::Instance::new(wanted);
    let mut all = wait(instance.enumerate_adapters(Backends::VULKAN));
    all.sort_by_key(|adapter| std::cmp::Reverse(kind(adapter.get_info().device_type)));
    all
}

fn described(adapter: &wgpu::Adapter) -> Adapter {
    let info = adapter.get_info();
    Adapter {
        kind: kind(info.device_type),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        name: info.name,
    }
}

fn kind(of: DeviceType) -> Kind {
    match of {
        DeviceType::DiscreteGpu => Kind::Discrete,
        DeviceType::IntegratedGpu => Kind::Integrated,
        DeviceType::VirtualGpu => Kind::Virtual,
        DeviceType::Cpu => Kind::Software,
        DeviceType::Other => Kind::Other,
    }
}

/// Returns the result of a future of `wgpu` that is ready immediately.
fn wait<F: Future>(future: F) -> F::Output {
    let mut future = std::pin::pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return value;
        }
        std::thread::yield_now();
    }
}
