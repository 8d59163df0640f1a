//! Epipolar errors of a rig, measured with points seen by several cameras.

use nalgebra::Point2;
use statistics::Sorted;

use crate::{Camera, Rig, epipolar};

/// Epipolar error of a pair of cameras, measured with the points that both saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairError {
    /// Indices of the two cameras in the rig.
    pub cameras: [usize; 2],
    /// Number of points that both cameras saw.
    pub n_points: usize,
    /// Median distance of the points from their epipolar lines, in ideal pixels. For each point, the distances in the two images are
    /// averaged.
    pub median_px: f64,
}

/// Epipolar error of a camera, measured together with all other cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraError {
    /// Index of the camera in the rig.
    pub camera: usize,
    /// Number of pairs of observations with this camera.
    pub n_points: usize,
    /// Median error over these pairs, in ideal pixels.
    pub median_px: f64,
}

/// Epipolar errors of a rig, measured with corresponding points.
#[derive(Debug, Clone, PartialEq)]
pub struct EpipolarReport {
    /// Errors of each pair of cameras that saw a common point.
    pub pairs: Vec<PairError>,
    /// Errors of each camera that saw a point together with another.
    pub cameras: Vec<CameraError>,
}

/// Measures the epipolar error of a rig.
///
/// * `points`: for each point, its pixel (recorded, distorted) in every camera, in the order of the rig; `None` if the camera did not see
///   it. Missing entries at the end count as not seen.
///
/// A camera with a much larger median than the others should be calibrated again.
pub fn epipolar_check(rig: &Rig, points: &[Vec<Option<Point2<f64>>>]) -> EpipolarReport {
    let n = rig.cameras().len();
    let mut of_camera = vec![Vec::new(); n];
    let mut pairs = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            let errors = pair_errors(&rig.cameras()[a], &rig.cameras()[b], points, [a, b]);
            of_camera[a].extend_from_slice(&errors);
            of_camera[b].extend_from_slice(&errors);
            let n_points = errors.len();
            pairs.extend(Sorted::new(errors).median().map(|median_px| PairError {
                cameras: [a, b],
                n_points,
                median_px,
            }));
        }
    }
    let cameras = of_camera.into_iter().enumerate().filter_map(|(camera, errors)| {
        let n_points = errors.len();
        Sorted::new(errors).median().map(|median_px| CameraError {
            camera,
            n_points,
            median_px,
        })
    });
    EpipolarReport {
        pairs,
        cameras: cameras.collect(),
    }
}

fn pair_errors(
    a: &Camera,
    b: &Camera,
    points: &[Vec<Option<Point2<f64>>>],
    [i, j]: [usize; 2],
) -> Vec<f64> {
    let fundamental = epipolar::fundamental(a, b);
    let error = |point: &Vec<Option<Point2<f64>>>| {
        let in_a = a.undistorted_px(&(*point.get(i)?)?)?;
        let in_b = b.undistorted_px(&(*point.get(j)?)?)?;
        let [at_a, at_b] = epipolar::symmetric_distance(&fundamental, &in_a, &in_b)?;
        Some(0.5 * (at_a + at_b))
    };
    points.iter().filter_map(error).collect()
}
