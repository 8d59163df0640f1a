//! Compares the results of a run with those of the same computation in one process, bit for bit.

use std::path::Path;

use fmp::Layout;
use footage::{Canvas, Fill, Size, Warp};
use geometry::files::ReadOptions;
use geometry::{Camera, Framing, OutSize, Rig, upright_roll};
use kernels::Rgb8View;
use pipeline::{BodySettings, Estimate, Estimator, EstimatorSettings, Skeleton};
use serde_json::{Value, json};
use skeleton::PARSE14;

use super::{Case, planted};

/// The computation in one process.
#[derive(Debug, Default)]
pub(crate) struct OneProcess {
    /// Settings of the steps.
    pub(crate) settings: EstimatorSettings,
    /// Size of the upright frames. If not set, frames equal the pictures.
    pub(crate) upright_size: Option<[u32; 2]>,
    /// Expected errors of the parts in a frame of a view, if there are any.
    pub(crate) sigma_px: Option<fn(frame: usize, view: usize) -> Vec<f32>>,
    /// Returns true if a view is missing in a frame. If not set, no view is missing.
    pub(crate) is_missing: Option<fn(frame: usize, view: usize) -> bool>,
}

impl OneProcess {
    /// Compares the results of a run with those of this computation.
    pub(crate) fn assert_same(&self, case: &Case, n_views: usize, n_frames: usize) {
        let rig = geometry::files::read(&case.path("rig.toml"), &ReadOptions::default()).unwrap();
        let mut views: Vec<View> = rig
            .cameras()
            .iter()
            .map(|camera| View::new(camera, &rig, self.upright_size))
            .collect();
        let cameras: Vec<Camera> = views.iter().map(|view| view.framing.camera().clone()).collect();
        let (model, up) = (planted::model(), rig.up_in_world());
        let mut settings = self.settings.clone();
        let shipped = Path::new(deployment::SHIPPED);
        settings.skeleton.body = BodySettings::NONE;
        settings.view.orientation = inputs::orientation(shipped, &model).unwrap();
        let mut estimator = Estimator::new(&model, &cameras, up, &settings).unwrap();
        let (pose3d, pose2d) = (case.lines("pose3d.jsonl"), case.lines("pose2d.jsonl"));
        assert_eq!((pose3d.len(), pose2d.len()), (n_frames, n_frames * n_views));
        let mut n_placed = 0;
        for frame in 0..n_frames {
            let pictures = rig.cameras().iter().map(|camera| planted::picture(camera, frame));
            let frames: Vec<Vec<u8>> =
                pictures.zip(&mut views).map(|(picture, view)| view.frame(&picture)).collect();
            let is_missing =
                |view: usize| self.is_missing.is_some_and(|is_missing| is_missing(frame, view));
            let images = frames.iter().zip(&views).enumerate();
            let images = images.map(|(nth, (it, view))| {
                let [width, height] = view.framing.out_size().map(|out_size| out_size as usize);
                (!is_missing(nth)).then(|| Rgb8View::new(width, height, it).unwrap())
            });
            let images: Vec<_> = images.collect();
            let sigma = (0..n_views).map(|view| Some(self.sigma_px?(frame, view)));
            let estimate = estimator.estimate(&images, &sigma.collect::<Vec<_>>());
            n_placed += estimate.skeleton.joints.iter().flatten().count();
            assert_same_skeleton(&pose3d[frame], frame, &estimate.skeleton);
            let there = views.iter().enumerate();
            for (view, it) in there.filter(|view| !is_missing(view.0)) {
                let line = &pose2d[frame * n_views + view];
                let layout = estimator.plans()[view].layout();
                it.assert_same(line, [frame, view], &estimate, layout);
                let sigma = self.sigma_px.map(|sigma_px| sigma_px(frame, view));
                assert_eq!(line["sigma_px"], json!(sigma), "frame {frame}, view {view}");
            }
        }
        assert!(
            n_placed > 10 * n_frames,
            "little to compare: {n_placed} joints"
        );
    }
}

/// Mapping from the pictures of a camera to the frames of the pipeline.
struct View {
    framing: Framing,
    warp: Warp,
}

impl View {
    fn new(camera: &Camera, rig: &Rig, upright_size: Option<[u32; 2]>) -> Self {
        let roll = upright_size.and_then(|_| upright_roll(camera, rig));
        let size = upright_size.map_or(OutSize::Scale(1.0), OutSize::Exact);
        let framing = Framing::new(camera, planted::SIZE, None, size, roll.unwrap_or(0.0)).unwrap();
        let size = |[width, height]: [u32; 2]| Size::new(width as usize, height as usize);
        let fill = match roll {
            Some(_) => Fill::Black,
            None => Fill::Replicate,
        };
        let map = framing.source_from_output();
        let warp = Warp::new(size(planted::SIZE), size(framing.out_size()), &map, fill);
        Self {
            warp: warp.unwrap(),
            framing,
        }
    }

    fn frame(&mut self, picture: &Canvas) -> Vec<u8> {
        let mut rgb = vec![0; self.warp.output_size().rgb_bytes()];
        self.warp.apply(picture.rgb(), &mut rgb);
        rgb
    }

    /// Converts a point of the frame to pixels of the picture.
    fn in_picture(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let map = self.framing.source_from_output();
        map.map(|row| row[0] * x + row[1] * y + row[2])
    }

    fn assert_same(
        &self,
        line: &Value,
        [frame, view]: [usize; 2],
        estimate: &Estimate,
        layout: &Layout,
    ) {
        assert_eq!(
            (&line["frame"], &line["view"]),
            (&json!(frame), &json!(planted::name(view)))
        );
        let model = planted::model();
        let answer = estimate.answers[view].as_ref().unwrap();
        let best = &answer.candidates[0];
        assert_eq!(line["single"]["candidates"], json!(answer.candidates.len()));
        assert_eq!(line["single"]["score"], json!(best.score));
        assert_eq!(line["single"]["level"], json!(best.level + 1));
        let parts = (0..model.n_parts()).map(|part| {
            let [x, y] = self.in_picture(best.centre(&model, layout, part));
            json!({ "x": x, "y": y, "type": best.parts[part].mixture + 1 })
        });
        assert_eq!(line["single"]["parts"], parts.collect::<Value>());
        let fused = estimate.skeleton.views[view].as_ref().unwrap();
        let parts = fused
            .pose
            .centres_px
            .iter()
            .map(|at| self.in_picture(*at))
            .map(|[x, y]| json!({ "x": x, "y": y }));
        let parts: Value = parts.collect();
        assert_eq!(line["fused"]["parts"], parts, "frame {frame}, view {view}");
        assert_eq!(line["fused"]["energy"], json!(fused.pose.energy));
        assert_eq!(line["facing"] == json!("behind"), fused.exchanged);
    }
}

/// Compares a line of `pose3d.jsonl` with an estimate.
pub(crate) fn assert_same_skeleton(line: &Value, frame: usize, skeleton: &Skeleton) {
    assert_eq!(line["frame"], json!(frame));
    let Some(person) = line["people"].get(0) else {
        assert_eq!(skeleton.joints.iter().flatten().count(), 0);
        return;
    };
    assert_eq!(line["people"].as_array().map(Vec::len), Some(1));
    assert_eq!(person["pairs"], json!(skeleton.n_pairs));
    assert_eq!(person["facing_margin"], json!(skeleton.facing_margin));
    for (joint, expected) in PARSE14.joints.iter().zip(&skeleton.joints) {
        let got = &person["joints"][joint.name];
        let Ok(expected) = expected else {
            assert_eq!(
                got["position_m"],
                Value::Null,
                "frame {frame}, {}",
                joint.name
            );
            continue;
        };
        let c = &expected.covariance;
        let covariance = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|i| c[i]);
        let position: [f64; 3] = expected.in_world.coords.into();
        assert_eq!(
            got["position_m"],
            json!(position),
            "frame {frame}, {}",
            joint.name
        );
        assert_eq!(got["covariance_m2"], json!(covariance));
        assert_eq!(got["reprojection_px"], json!(expected.reprojection_px));
    }
}
