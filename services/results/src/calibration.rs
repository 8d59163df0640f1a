//! Checks, by the poses that each view found on its own, that every camera is at its calibrated pose, and that its pictures were taken at
//! their stated times.

use std::collections::BTreeMap;

use geometry::{Camera, RigWatch, StepWatch, SwapWatch};
use messages::{SkeletonMessage, Status};
use runfiles::{CameraFit, Contradicted, Exchanged};

use crate::{FrameRecord, Scene, ViewRecord, own};

/// Checks all cameras over a run.
#[derive(Debug)]
pub(crate) struct Calibration {
    watch: RigWatch,
    swaps: SwapWatch,
    steps: StepWatch,
    exchanged: Option<Exchanged>,
    is_contradiction_told: bool,
    fits: Vec<CameraFit>,
}

impl Calibration {
    pub(crate) fn new(scene: &Scene) -> Self {
        let cameras = scene.views.iter().map(|view| view.framing.camera().clone());
        let cameras: Vec<Camera> = cameras.collect();
        let framings = scene.views.iter().map(|view| view.framing.clone());
        let n = scene.views.len();
        Self {
            steps: StepWatch::new(cameras.clone()),
            watch: RigWatch::new(cameras),
            swaps: SwapWatch::new(framings.collect(), scene.model.spec().mirror.clone()),
            exchanged: None,
            is_contradiction_told: false,
            fits: vec![CameraFit::default(); n],
        }
    }

    /// Adds the poses that the views found in a frame, each on its own. If there are several people, one is used who is not near another
    /// one; otherwise a view may have found another person. By the paper's method, the candidates of the views are not compared with the
    /// people, so frames with several people are not used.
    pub(crate) fn add(&mut self, scene: &Scene, record: &FrameRecord) {
        let is_alone = record.skeletons.n_seen <= 1;
        let person = if is_alone {
            record.followed()
        } else {
            own::apart(record).filter(|_| scene.has_maps)
        };
        if !is_alone && person.is_none() {
            return;
        }
        let points: Vec<_> =
            (0..scene.views.len()).map(|view| parts(scene, record, view, person)).collect();
        // In an empty room, a network's false detections are in different places in different views. Their disagreement does not show that
        // a camera is wrong.
        let is_there = |person: &SkeletonMessage| person.status == Status::OK;
        if !scene.has_maps || person.is_some_and(is_there) {
            self.watch.note(&points);
        }
        // If the footage of two cameras was swapped, the candidates nearest to the person are those of other people.
        if is_alone {
            self.swaps.note(&points);
            self.find_exchanged(scene);
            self.tell_contradiction(scene);
        }
        // Delays are estimated from the motion of one person.
        if person.map(|person| person.id) == record.followed().map(|person| person.id) {
            self.follow_steps(scene, record, &points);
        }
        for (view, fit) in self.fits.iter_mut().enumerate() {
            let scale = scene.views[view].source_scale();
            fit.residual_px = self.watch.residual_px(view).map(|value| value * scale);
            fit.without_px = self.watch.without_px(view).map(|value| value * scale);
            // If the footage of two cameras was swapped, every camera contradicts the calibration. While a person walks, a camera whose
            // pictures are late also contradicts it. A camera that was moved does not look late.
            let is_named =
                self.watch.is_reported(view) && self.exchanged.is_none() && !fit.out_of_step;
            if is_named && !fit.suspected {
                tracing::warn!(
                    camera = scene.views[view].name,
                    residual_px = fit.residual_px,
                    without_px = fit.without_px,
                    "the camera is not where the calibration says"
                );
            }
            fit.suspected = is_named;
        }
    }

    /// Estimates the delay of every camera, and logs once if a camera is not synchronised with the others.
    fn follow_steps(
        &mut self,
        scene: &Scene,
        record: &FrameRecord,
        points: &[Option<Vec<[f64; 2]>>],
    ) {
        let Some(instant_s) = scene.time_s(record.frame()) else {
            return;
        };
        let skew_s = |view: &ViewRecord| {
            let read = wire::skew_from_message(view.pose.as_ref()?);
            read.ok()
        };
        let skews_s: Vec<f64> =
            record.views.iter().map(|view| skew_s(view).unwrap_or(0.0)).collect();
        self.steps.note(instant_s, points, &skews_s);
        for (view, fit) in self.fits.iter_mut().enumerate() {
            let step = self.steps.step(view);
            fit.offset_ms = step.map(|step| step.offset_ms);
            fit.offset_error_ms = step.map(|step| step.error_ms);
            // If the footage of two cameras was swapped, no delay explains the contradictions.
            let is_named = self.steps.is_reported(view) && self.exchanged.is_none();
            if is_named && !fit.out_of_step {
                tracing::warn!(
                    camera = scene.views[view].name,
                    offset_ms = fit.offset_ms,
                    offset_error_ms = fit.offset_error_ms,
                    "the camera is not synchronised: its pictures were not taken at their stated times"
                );
            }
            fit.out_of_step = is_named;
        }
    }

    /// Looks for two cameras whose footage was swapped (each has the other's pictures), and logs them once.
    fn find_exchanged(&mut self, scene: &Scene) {
        let Some(it) = self.swaps.swap().filter(|_| self.exchanged.is_none()) else {
            return;
        };
        let cameras = it.views.map(|view| scene.views[view].name.clone());
        tracing::warn!(
            "the footage of {} and {} seems to be swapped: rays to the same part miss each other by {:.1} degrees, but only by {:.1} \
             degrees if the footage of the two is swapped{}",
            cameras[0],
            cameras[1],
            it.degrees,
            it.exchanged_degrees,
            if it.is_sure {
                ""
            } else {
                "; perhaps two other cameras are swapped instead"
            },
        );
        self.exchanged = Some(Exchanged {
            cameras,
            degrees: it.degrees,
            exchanged_degrees: it.exchanged_degrees,
            sure: it.is_sure,
        });
    }

    /// Logs a contradiction between the cameras once, as soon as it is known.
    fn tell_contradiction(&mut self, scene: &Scene) {
        let names = || scene.views.iter().map(|view| view.name.clone());
        let Some(it) = self.contradicted(names()).filter(|_| !self.is_contradiction_told) else {
            return;
        };
        self.is_contradiction_told = true;
        tracing::warn!(
            "the cameras contradict each other: rays to the same part miss each other by {:.1} degrees (normally at most {:.1} degrees)",
            it.degrees,
            it.usual_degrees
        );
    }

    /// Returns the contradiction between the cameras, unless two cameras with swapped footage explain it.
    ///
    /// * `names`: names of the views, in their order.
    pub(crate) fn contradicted(&self, names: impl Iterator<Item = String>) -> Option<Contradicted> {
        let it = self.swaps.contradiction();
        let it = it.filter(|_| self.exchanged.is_none())?;
        let names: Vec<String> = names.collect();
        Some(Contradicted {
            degrees: it.degrees,
            usual_degrees: it.usual_degrees,
            likely: it.likely.map(|pair| pair.map(|view| names[view].clone())),
        })
    }

    /// Returns the two cameras whose footage seems to be swapped.
    pub(crate) fn exchanged(&self) -> Option<&Exchanged> {
        self.exchanged.as_ref()
    }

    /// Returns the state of every camera, by name.
    ///
    /// * `names`: names of the views, in their order.
    pub(crate) fn fits(&self, names: impl Iterator<Item = String>) -> BTreeMap<String, CameraFit> {
        names.zip(self.fits.iter().copied()).collect()
    }
}

/// Returns the parts of a view's own candidate for a person, in pixels of the frame, with left and right as seen by the person. Returns
/// `None` if the view does not see a person clearly.
fn parts(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
    person: Option<&SkeletonMessage>,
) -> Option<Vec<[f64; 2]>> {
    let fused = record.fused(view);
    // With maps of networks, fusion leaves out views that contradict the others. These are the views that must be checked, so a view that
    // was left out is not skipped here.
    if fused.is_none() && !scene.has_maps {
        return None;
    }
    let readings = own::readings(scene, record, view, person)?;
    let is_exchanged = match fused {
        Some(fused) if !scene.has_maps => fused.exchanged == 1,
        // A network may name left and right as seen in the picture. The 3D solution shows which side is the person's left.
        _ => person.is_some_and(|person| own::is_exchanged(scene, person, view, &readings)),
    };
    let [named, exchanged] = readings;
    Some(if is_exchanged { exchanged } else { named })
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::testing::{record, scene};

    #[test]
    fn every_camera_has_an_entry_and_with_two_cameras_none_is_suspected() {
        let scene = scene();
        let mut it = Calibration::new(&scene);
        for frame in 0..100 {
            it.add(&scene, &record(frame));
        }
        let names = scene.views.iter().map(|view| view.name.clone());
        let fits = it.fits(names);
        assert_eq!(fits["left"], CameraFit::default());
        assert_eq!(fits.len(), 2);
    }

    #[test]
    fn a_view_that_fusion_left_out_is_still_checked() {
        let scene = scene();
        let mut record = record(0);
        record.skeletons.people[0].views[0].status = Status::NO_DETECTION;
        assert_eq!(parts(&scene, &record, 0, record.followed()), None);
        let maps = Scene {
            has_maps: true,
            ..scene
        };
        let seen = pipeline::Sighting {
            joints: [Some([9.0, 7.0]); 14],
            heats: [0.9; 14],
            score: 0.5,
            front: [0.0; 2],
            extras: Vec::new(),
            colour: None,
            age_s: 0.0,
        };
        let old = pipeline::Sighting {
            age_s: 0.1,
            ..seen.clone()
        };
        record.views[0].pose = wire::sightings_to_message(&[old], 0, [80, 60]).ok();
        assert_eq!(parts(&maps, &record, 0, record.followed()), None);
        record.views[0].pose = wire::sightings_to_message(&[seen], 0, [80, 60]).ok();
        assert_eq!(
            parts(&maps, &record, 0, record.followed()).unwrap().len(),
            skeleton::N_PARTS
        );
        let strict = Scene {
            least_heat: 0.95,
            ..maps
        };
        assert_eq!(parts(&strict, &record, 0, record.followed()), None);
    }

    #[test]
    fn a_view_without_people_is_not_used_for_the_check() {
        let scene = scene();
        let mut record = record(0);
        assert_eq!(
            parts(&scene, &record, 0, record.followed()).unwrap().len(),
            1
        );
        record.skeletons.people[0].views[0].status = Status::NO_DETECTION;
        assert_eq!(parts(&scene, &record, 0, record.followed()), None);
        record.views[1].pose = None;
        assert_eq!(parts(&scene, &record, 1, record.followed()), None);
        record.skeletons.people[0].n_views = 0;
        assert_eq!(parts(&scene, &record, 1, record.followed()), None);
    }
}
