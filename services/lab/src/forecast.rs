//! Forecast of the resources that cameras and hosts need: processor time, network, latency. It is computed from measured costs.
//!
//! Frames arrive at a fixed rate, so there is no random queueing (unlike in an M/D/1 queue). A process waits only while other processes of
//! its host use the cores. A host is full when its processes use all of its cores.

use serde::Serialize;

/// Processor time for one frame of one view, in milliseconds, and sizes of its messages.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Costs {
    /// Time of `capture`.
    pub capture_ms: f64,
    /// Time of `pose`.
    pub pose_ms: f64,
    /// Time to encode a frame as JPEG, on the host of the camera.
    pub encode_ms: f64,
    /// Time to decode a JPEG, on the fusing host.
    pub decode_ms: f64,
    /// Time of `fuse`, `triangulate` and `results` for each view of a frame.
    pub fuse_ms_per_view: f64,
    /// Time of the same processes for each frame, independent of the number of views.
    pub fuse_ms: f64,
    /// Bytes of a frame as JPEG at search size, with its header.
    pub frame_bytes: f64,
    /// Bytes of the poses of a view, with their header.
    pub pose_bytes: f64,
    /// Network time of a small message in one direction.
    pub network_ms: f64,
}

/// Cameras and hosts to plan for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Load {
    /// Number of cameras.
    pub n_cameras: usize,
    /// Number of hosts, including the fusing host; 1 for a single machine without a link.
    pub n_hosts: usize,
    /// Cores of each host.
    pub n_cores: f64,
    /// Frames per second.
    pub rate_hz: f64,
    /// Bytes per second that a host can send or receive.
    pub network_bytes_s: f64,
    /// True if hosts send poses instead of frames.
    pub with_poses: bool,
    /// Number of views on the fusing host; `None` to distribute them by cost.
    pub near: Option<usize>,
}

/// Resources that a load needs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Forecast {
    /// Number of views on the fusing host, and the largest number on another host.
    pub views: [usize; 2],
    /// Cores in use on the fusing host, and the largest number on another host.
    pub cores: [f64; 2],
    /// Bytes per second that the fusing host receives, and the most that another host sends.
    pub bytes_s: [f64; 2],
    /// Latency from capture to result in milliseconds, if the load fits.
    pub latency_ms: f64,
    /// The part of this latency that is due to the link between hosts: JPEG codec and network.
    pub link_ms: f64,
    /// True if every host has enough cores and the network has enough capacity.
    pub fits: bool,
}

/// Returns the resources that cameras on hosts need. Cameras are distributed evenly by cost: the fusing host gets
/// fewer of them, because it has more work. If the load has `near`, the fusing host gets this number of views.
pub fn forecast(costs: &Costs, load: &Load) -> Forecast {
    let n_far = load.n_hosts.saturating_sub(1);
    if let Some(near) = load.near.filter(|near| n_far > 0 && *near <= load.n_cameras) {
        return with_views(costs, load, near, n_far);
    }
    let options = (0..=load.n_cameras).filter(|near| n_far > 0 || *near == load.n_cameras);
    let all = options.map(|near| with_views(costs, load, near, n_far));
    let worst = |forecast: &Forecast| forecast.cores[0].max(forecast.cores[1]);
    let best = all.min_by(|a, b| worst(a).total_cmp(&worst(b)));
    best.unwrap_or_else(|| with_views(costs, load, load.n_cameras, n_far))
}

fn with_views(costs: &Costs, load: &Load, near: usize, n_far: usize) -> Forecast {
    let far = load.n_cameras - near;
    let most_far = if n_far == 0 { 0 } else { far.div_ceil(n_far) };
    let busy = |ms: f64| ms * 1e-3 * load.rate_hz;
    let at_camera = if load.with_poses {
        costs.capture_ms + costs.pose_ms
    } else {
        costs.capture_ms + costs.encode_ms
    };
    let at_fusion = if load.with_poses {
        0.0
    } else {
        costs.decode_ms + costs.pose_ms
    };
    let own = costs.capture_ms + costs.pose_ms;
    let fusing = costs.fuse_ms + load.n_cameras as f64 * costs.fuse_ms_per_view;
    let cores = [
        busy(near as f64 * own + far as f64 * at_fusion + fusing),
        busy(most_far as f64 * at_camera),
    ];
    let bytes = if load.with_poses {
        costs.pose_bytes
    } else {
        costs.frame_bytes
    };
    let bytes_s = [far, most_far].map(|views| views as f64 * bytes * load.rate_hz);
    // The processes of one frame run at the same time and share the cores.
    let rounds = |views: usize, ms: f64| ms * (views as f64 / load.n_cores.max(1.0)).max(1.0);
    let n_poses_here = if load.with_poses {
        near
    } else {
        load.n_cameras
    };
    let codec = if load.with_poses || far == 0 {
        0.0
    } else {
        rounds(most_far, costs.encode_ms) + rounds(far, costs.decode_ms)
    };
    let wire = if far == 0 {
        0.0
    } else {
        let slowest = far as f64 * bytes / load.network_bytes_s.max(1.0);
        costs.network_ms + 1e3 * slowest
    };
    let n_poses = n_poses_here.max(if load.with_poses { most_far } else { 0 });
    let pose = rounds(n_poses, costs.pose_ms);
    let capture = rounds(near.max(most_far), costs.capture_ms);
    let link_ms = codec + wire;
    let is_free = |cores: f64| cores <= 0.9 * load.n_cores;
    Forecast {
        views: [near, most_far],
        cores,
        bytes_s,
        latency_ms: capture + pose + fusing + link_ms,
        link_ms,
        fits: cores.into_iter().all(is_free)
            && bytes_s.into_iter().all(|bytes_s| bytes_s <= 0.8 * load.network_bytes_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: Costs = Costs {
        capture_ms: 5.0,
        pose_ms: 40.0,
        encode_ms: 3.0,
        decode_ms: 2.0,
        fuse_ms_per_view: 4.0,
        fuse_ms: 2.0,
        frame_bytes: 25_000.0,
        pose_bytes: 4_000.0,
        network_ms: 0.3,
    };

    const LOAD: Load = Load {
        n_cameras: 4,
        n_hosts: 1,
        n_cores: 4.0,
        rate_hz: 10.0,
        network_bytes_s: 100e6,
        with_poses: false,
        near: None,
    };

    #[test]
    fn one_host_has_no_link() {
        let got = forecast(&COSTS, &LOAD);
        assert_eq!(
            (got.views, got.bytes_s, got.link_ms),
            ([4, 0], [0.0; 2], 0.0)
        );
        assert!((got.cores[0] - 1.98).abs() < 1e-9, "{got:?}");
        assert!((got.latency_ms - 63.0).abs() < 1e-9, "{got:?}");
        assert!(got.fits);
    }

    #[test]
    fn a_second_host_takes_the_processes_for_which_the_first_has_no_cores() {
        let load = Load {
            n_cameras: 16,
            ..LOAD
        };
        assert!(!forecast(&COSTS, &load).fits);
        let with_poses = Load {
            n_hosts: 3,
            with_poses: true,
            ..load
        };
        let got = forecast(&COSTS, &with_poses);
        assert!(got.fits, "{got:?}");
        // Every view has a host, and the fusing host has no more views than the others.
        assert!(got.views[0] <= got.views[1] && got.views[0] + 2 * got.views[1] >= 16);
        assert!(got.bytes_s[0] < 16.0 * 4_000.0 * 10.0 + 1.0);
    }

    #[test]
    fn if_frames_are_transferred_the_poses_are_computed_on_the_fusing_host() {
        let load = Load {
            n_cameras: 16,
            n_hosts: 3,
            ..LOAD
        };
        let got = forecast(&COSTS, &load);
        // The fusing host still finds all poses, so more hosts do not help.
        assert!(got.cores[0] > 16.0 * 0.4, "{got:?}");
        assert!(!got.fits);
    }

    #[test]
    fn a_given_split_of_the_views_is_not_changed() {
        let load = Load {
            n_hosts: 3,
            near: Some(3),
            ..LOAD
        };
        assert_eq!(forecast(&COSTS, &load).views, [3, 1]);
    }

    #[test]
    fn a_slow_network_does_not_fit() {
        let slow = Load {
            n_hosts: 2,
            network_bytes_s: 1e4,
            ..LOAD
        };
        let got = forecast(&COSTS, &slow);
        assert!(got.bytes_s[0] == 0.0 || !got.fits, "{got:?}");
    }
}
