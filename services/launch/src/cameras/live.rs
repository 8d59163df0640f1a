//! Determines the properties of every camera's pictures before the run, for files and live cameras.

use std::path::Path;
use std::thread;

use capture::{Feed, LiveCamera, LiveError, Retimed};
use deployment::capture::{Camera, CameraClock, Config, Transport};
use deployment::{Deployment, Timeline};
use failure::{ExitKind, Failure, Fault as _};
use footage::LiveAddress;
use scene::Address;

use super::{Footage, advice, source};

/// Number of frames of a live camera without an end. It is larger than the number of frames of any footage.
pub(crate) const ENDLESS: u64 = 1_000_000_000_000;

/// Returns true if the source of a camera is live. If a file has this name, the source is the file.
pub fn is_live(source: &str) -> bool {
    footage::is_live(source) && !Path::new(source).is_file()
}

/// Returns the live camera of an entry of a deployment; `None` if its source is footage.
pub fn live_camera(camera: &Camera) -> Option<LiveCamera> {
    let address = LiveAddress::parse(&camera.source).filter(|_| is_live(&camera.source))?;
    Some(LiveCamera {
        address,
        format: camera.format.clone(),
        size: camera.size,
        rate_hz: camera.frame_rate_hz,
        controls: camera.controls.clone(),
        transport: camera.transport.map(|transport| match transport {
            Transport::Tcp => footage::Transport::Tcp,
            Transport::Udp => footage::Transport::Udp,
        }),
        has_own_clock: camera.clock != Some(CameraClock::Arrival),
        most_shrink: 1,
    })
}

/// Reads the metadata of every camera's footage. All live cameras are queried at the same time.
///
/// * `is_here`: returns true if a camera is on this machine. For other cameras, the calibration gives the properties.
pub(crate) fn footage(
    deployment: &Deployment,
    is_here: &dyn Fn(usize) -> bool,
) -> Result<Vec<Footage>, Failure> {
    let capture = &deployment.capture;
    let all: Vec<Result<Footage, Failure>> = thread::scope(|scope| {
        let asked: Vec<_> = deployment
            .cameras
            .iter()
            .enumerate()
            .map(|(index, camera)| {
                let live = live_camera(camera).filter(|_| is_here(index))?;
                let thread = thread::Builder::new().name(camera.name.clone());
                thread.spawn_scoped(scope, move || live.look()).ok()
            })
            .collect();
        let cameras = deployment.cameras.iter().enumerate().zip(asked);
        let read = cameras.map(|((index, camera), asked)| {
            match asked.map(thread::ScopedJoinHandle::join) {
                None if is_here(index) || Address::is_address(&camera.source) => {
                    of_files(camera, capture)
                }
                None => elsewhere(deployment, camera),
                Some(Ok(found)) => {
                    found.map(|look| of_live(look, capture)).map_err(|error| refused(error, camera))
                }
                Some(Err(_panic)) => {
                    Err(Failure::new(ExitKind::Run, "a camera could not be queried"))
                }
            }
        });
        read.collect()
    });
    let names = deployment.cameras.iter().map(|camera| camera.name.as_str());
    let all = inputs::advice::of_all(names.zip(all).collect())?;
    if deployment.has_clocks() {
        retimed(deployment, all)
    } else {
        Ok(all)
    }
}

/// Returns the footage, resampled at the frame times that all cameras share.
fn retimed(deployment: &Deployment, footage: Vec<Footage>) -> Result<Vec<Footage>, Failure> {
    let capture = &deployment.capture;
    let mut clocks = Vec::new();
    for (camera, found) in footage.iter().enumerate() {
        let name = &deployment.cameras[camera].name;
        let rate_hz = found.frame_rate_hz.ok_or_else(|| {
            let message = format!(
                "cameras have `offset_ms`, but the frame rate of camera {name:?} is not known"
            );
            Failure::new(ExitKind::Config, message).with_hint("set `capture.frame_rate_hz`")
        })?;
        clocks.push(deployment.clock(camera, rate_hz * capture.frame_step as f64));
    }
    let timelines = Timeline::all(&clocks);
    let cameras = deployment.cameras.iter().zip(timelines).zip(footage);
    let looked = cameras.map(|((camera, timeline), found)| {
        let info = Retimed::look(&source(camera, capture), Some(&timeline)).map_err(|error| {
            let hint = format!(
                "camera {:?}: with this `offset_ms` and `drift_ppm`, does its footage overlap in time with that of the other cameras?",
                camera.name
            );
            Failure::new(ExitKind::Input, error).with_hint(hint)
        })?;
        Ok(Footage {
            n_frames: info.n_frames,
            frame_rate_hz: info.frame_rate_hz,
            timeline: Some(timeline),
            ..found
        })
    });
    looked.collect()
}

/// Returns the time from the beginning of a run to its first frame in real time, in nanoseconds. It is long enough for every process to
/// start, and for every stream to deliver its first picture.
pub(crate) fn lead_nanos(deployment: &Deployment) -> u64 {
    const FOOTAGE: u64 = 2_000_000_000;
    const DEVICES: u64 = 3_000_000_000;
    const STREAMS: u64 = 6_000_000_000;
    let cameras = deployment.cameras.iter().filter_map(live_camera);
    let leads = cameras.map(|camera| match camera.address {
        LiveAddress::Device(_) => DEVICES,
        LiveAddress::Stream(_) => STREAMS,
    });
    leads.max().unwrap_or(FOOTAGE)
}

fn of_files(camera: &Camera, capture: &Config) -> Result<Footage, Failure> {
    let info = Feed::look(&source(camera, capture));
    let info = info.map_err(|error| {
        let hint = advice::on_footage(&error, &camera.name);
        Failure::new(ExitKind::Input, error).with_hint(hint)
    })?;
    if let Some(depth) = info.depth {
        tracing::warn!(
            "camera {:?}: the pictures of {} have 16 bits, but use only {}: the brightest value is {}; they are scaled accordingly",
            camera.name,
            camera.source,
            depth.bits,
            depth.brightest
        );
    }
    if info.is_interlaced {
        let file = failure::wording::shell(&camera.source);
        tracing::warn!(
            "camera {:?}: {} is interlaced: every picture consists of two halves from different moments, so \
             moving people have jagged edges; use `ffmpeg -i {file} -vf bwdif=mode=send_frame -c:v libx264 -crf 15 progressive.mp4` to deinterlace it",
            camera.name,
            camera.source
        );
    }
    if let Some(uneven_s) = info.uneven_s.filter(|_| camera.keypoints.is_none()) {
        let file = failure::wording::shell(&camera.source);
        let uneven_ms = 1e3 * uneven_s;
        tracing::warn!(
            "camera {:?}: the pictures of {} are not evenly spaced in time, by up to {uneven_ms:.0} ms, but pictures of different cameras are \
             matched by their numbers; if other cameras were recorded in another way, use `ffmpeg -i {file} -vf fps=RATE -c:v libx264 -crf \
             15 even.mp4` with the same RATE for every camera",
            camera.name,
            camera.source
        );
    }
    Ok(Footage {
        size: [info.size.width as u32, info.size.height as u32],
        n_frames: info.n_frames,
        frame_rate_hz: info.frame_rate_hz,
        timeline: None,
    })
}

fn of_live((size, rate_hz): (footage::Size, f64), capture: &Config) -> Footage {
    Footage {
        size: [size.width as u32, size.height as u32],
        n_frames: capture.n_frames.unwrap_or(ENDLESS),
        frame_rate_hz: Some(rate_hz / capture.frame_step as f64),
        timeline: None,
    }
}

/// Returns the properties of a camera of another host.
fn elsewhere(deployment: &Deployment, camera: &Camera) -> Result<Footage, Failure> {
    let capture = &deployment.capture;
    let rig = inputs::rig_of(deployment)?;
    // A camera that is not in the rig is reported later, with its name.
    let size = rig.camera(&camera.name).map_or([1; 2], |camera| camera.intrinsics.size);
    let rate_hz = capture.frame_rate_hz;
    Ok(Footage {
        size,
        n_frames: capture.n_frames.unwrap_or(ENDLESS),
        frame_rate_hz: rate_hz.map(|rate_hz| rate_hz / capture.frame_step as f64),
        timeline: None,
    })
}

fn refused(error: LiveError, camera: &Camera) -> Failure {
    let hint = format!(
        "this is the live camera {:?}; `parallax cameras` lists the video devices of this machine and their formats, and \
         `parallax cameras view {}` takes a picture",
        camera.name,
        failure::wording::shell(footage::without_passwords(&camera.source))
    );
    Failure::new(error.kind(), error).with_hint(hint)
}
