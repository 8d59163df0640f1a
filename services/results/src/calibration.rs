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
    use std::f64::consts::PI;
    use std::sync::Arc;

    use geometry::{Framing, OutSize};
    use nalgebra::{Isometry3, Point3, Translation3, Vector3};

    use super::*;
    use crate::View;
    use crate::testing::{record, scene, sighting, skeletons};

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
        let seen = sighting([[9.0, 7.0]; 14]);
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

    /// Returns a scene of four cameras on a ring of radius 4 m that look at the origin.
    fn ring() -> Scene {
        let scene = scene();
        let view = |nth: u8| {
            let angle = f64::from(nth) * std::f64::consts::FRAC_PI_2;
            let eye = Point3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.0);
            let look = Isometry3::look_at_rh(&eye, &Point3::origin(), &Vector3::z());
            let mut camera = scene.views[0].framing.camera().clone();
            camera.intrinsics.size = [160, 120];
            // The camera's y points down.
            camera.camera_from_world = Isometry3::rotation(Vector3::x() * PI) * look;
            let size = [160, 120];
            let framing = Framing::new(&camera, size, None, OutSize::Exact(size), 0.0).unwrap();
            View {
                name: format!("c{nth}"),
                framing,
                layout: Arc::clone(&scene.views[0].layout),
            }
        };
        Scene {
            views: (0..4).map(view).collect(),
            has_maps: true,
            ..scene
        }
    }

    /// Returns the cameras that are named after 30 frames of two people.
    ///
    /// * `apart_m`: distance of the people.
    /// * `moved_m`: distance by which camera c2 was moved since its calibration.
    fn named(apart_m: f64, moved_m: f64) -> Vec<String> {
        let scene = ring();
        let mut calibration = Calibration::new(&scene);
        let joints = |x: f64| -> [Point3<f64>; 14] {
            core::array::from_fn(|nth| {
                let turn = nth as f64;
                Point3::new(x + 0.2 * turn.cos(), 0.2 * turn.sin(), 0.1 * turn - 0.7)
            })
        };
        let people = [-0.5, 0.5].map(|side| joints(side * apart_m));
        let mut record = record(0);
        (record.skeletons.n_people, record.skeletons.n_seen) = (2, 2);
        for ((message, id), joints) in record.skeletons.people.iter_mut().zip(1..).zip(&people) {
            (*message, message.id) = (skeletons(0).people[0], id);
            for (place, joint) in message.joints.iter_mut().zip(joints) {
                place.in_world = joint.coords.into();
            }
        }
        record.views.resize(4, record.views[0].clone());
        for (nth, view) in record.views.iter_mut().enumerate() {
            let mut camera = scene.views[nth].framing.camera().clone();
            if nth == 2 {
                let by = Translation3::new(moved_m, 0.0, 0.0);
                camera.camera_from_world = by * camera.camera_from_world;
            }
            let seen = people.map(|joints| {
                sighting(joints.map(|joint| {
                    let at = camera.project(&joint).unwrap();
                    [at.x as f32, at.y as f32]
                }))
            });
            view.pose = wire::sightings_to_message(&seen, 0, [160, 120]).ok();
        }
        for _ in 0..30 {
            calibration.add(&scene, &record);
        }
        let fits = calibration.fits(scene.views.iter().map(|view| view.name.clone()));
        let named = fits.into_iter().filter(|(_, fit)| fit.suspected);
        named.map(|(name, _)| name).collect()
    }

    #[test]
    fn a_moved_camera_is_named_while_several_people_who_are_apart_are_in_view() {
        assert_eq!(named(2.0, 0.3), ["c2"]);
        assert_eq!(named(2.0, 0.0), [""; 0]);
        assert_eq!(
            named(0.5, 0.3),
            [""; 0],
            "their candidates are not told apart"
        );
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
