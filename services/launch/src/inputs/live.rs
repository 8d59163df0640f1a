//! What is known of the pictures of every camera before the run: of files, and of live cameras.

use std::path::Path;
use std::thread;

use capture::{Feed, LiveCamera, LiveError};
use deployment::Deployment;
use deployment::capture::{Camera, Config, Transport};
use footage::LiveAddress;
use runtime::{ExitKind, Failure, Fault as _};

use super::{Footage, advice, source, warn_of_orientation_tag};

/// Frames of a live camera that runs until it is stopped: the most of any footage.
pub(crate) const ENDLESS: u64 = 1_000_000_000_000;

/// Whether the source of a camera is live: a file of such a name is none.
pub fn is_live(source: &str) -> bool {
    footage::is_live(source) && !Path::new(source).is_file()
}

/// The live camera of an entry of a deployment; none if its source is footage.
pub fn live_camera(camera: &Camera) -> Option<LiveCamera> {
    let address = LiveAddress::parse(&camera.source).filter(|_| is_live(&camera.source))?;
    Some(LiveCamera {
        address,
        format: camera.format.clone(),
        size: camera.size,
        rate_hz: camera.frame_rate_hz,
        controls: camera.controls.clone(),
        transport: camera.transport.map(|it| match it {
            Transport::Tcp => footage::Transport::Tcp,
            Transport::Udp => footage::Transport::Udp,
        }),
    })
}

/// Reads the metadata of every camera's footage; live cameras are asked all at once.
pub(crate) fn footage(deployment: &Deployment) -> Result<Vec<Footage>, Failure> {
    let capture = &deployment.capture;
    let all: Vec<Result<Footage, Failure>> = thread::scope(|scope| {
        let asked: Vec<_> = deployment
            .cameras
            .iter()
            .map(|camera| {
                let live = live_camera(camera)?;
                let thread = thread::Builder::new().name(camera.name.clone());
                thread.spawn_scoped(scope, move || live.look()).ok()
            })
            .collect();
        let cameras = deployment.cameras.iter().zip(asked);
        let read = cameras.map(
            |(camera, asked)| match asked.map(thread::ScopedJoinHandle::join) {
                None => of_files(camera, capture),
                Some(Ok(found)) => found
                    .map(|it| of_live(it, capture))
                    .map_err(|it| refused(it, camera)),
                Some(Err(_panic)) => {
                    Err(Failure::new(ExitKind::Run, "a camera could not be asked"))
                }
            },
        );
        read.collect()
    });
    all.into_iter().collect()
}

fn of_files(camera: &Camera, capture: &Config) -> Result<Footage, Failure> {
    let info = Feed::look(&source(camera, capture));
    let info = info.map_err(|error| {
        let hint = advice::on_footage(&error, &camera.name);
        Failure::new(ExitKind::Input, error).with_hint(hint)
    })?;
    warn_of_orientation_tag(&format!("camera {:?}", camera.name), info.turn);
    Ok(Footage {
        size: [info.size.width as u32, info.size.height as u32],
        n_frames: info.n_frames,
        frame_rate_hz: info.frame_rate_hz,
    })
}

fn of_live((size, rate_hz): (footage::Size, f64), capture: &Config) -> Footage {
    Footage {
        size: [size.width as u32, size.height as u32],
        n_frames: capture.n_frames.unwrap_or(ENDLESS),
        frame_rate_hz: Some(rate_hz / capture.frame_step as f64),
    }
}

fn refused(error: LiveError, camera: &Camera) -> Failure {
    let hint = format!(
        "this is the live camera {:?}; `parallax cameras` lists the video devices of this machine with what they offer, and \
         `parallax cameras view {}` takes a picture",
        camera.name,
        footage::without_passwords(&camera.source)
    );
    Failure::new(error.kind(), error).with_hint(hint)
}
