//! Simulated people in front of cameras on a circle.

use geometry::{Intrinsics, Lens, LensModel};
use nalgebra::Isometry3;
use proptest::prelude::*;

use super::*;

const SIZE: f64 = 640.0;

pub(crate) fn camera(view: usize) -> Camera {
    let bearing = 1.2 * view as f64;
    let eye = Point3::new(5.0 * bearing.cos(), 5.0 * bearing.sin(), 1.5);
    let upright = Isometry3::look_at_rh(&eye, &Point3::new(0.0, 0.0, 1.0), &Vector3::z());
    // `look_at_rh` has x right, y up, z backward: a rotation by 180 degrees about x gives OpenCV's axes.
    let opencv = Isometry3::rotation(Vector3::x() * core::f64::consts::PI);
    Camera {
        name: format!("camera {view}"),
        intrinsics: Intrinsics {
            fx: SIZE,
            fy: SIZE,
            cx: SIZE / 2.0,
            cy: SIZE / 2.0,
            size: [SIZE as u32; 2],
            lens: Lens::new(LensModel::Pinhole),
        },
        camera_from_world: opencv * upright,
    }
}

/// Returns a view's sighting of a person who stands at a given position.
fn sighting(camera: &Camera, [x, y]: [f64; 2], strength: f64) -> FoundBody {
    let line = [1.75, 1.5, 0.95, 0.5, 0.08].map(|z| Point3::new(x, y, z));
    let points_px = line.map(|line| <[f64; 2]>::from(camera.project(&line).unwrap()));
    FoundBody {
        points_px,
        rays: points_px.map(|[x, y]| camera.ray(&Point2::new(x, y))),
        size_px: points_px[4][1] - points_px[0][1],
        strength,
    }
}

/// Returns the sightings of people in all views, in an order that differs from view to view.
fn seen(cameras: &[Camera], people: &[([f64; 2], f64)]) -> Vec<Vec<FoundBody>> {
    let of_view = |(view, camera): (usize, &Camera)| {
        let mut all: Vec<FoundBody> = people
            .iter()
            .map(|(place, strength)| sighting(camera, *place, *strength))
            .collect();
        let n = all.len().max(1);
        all.rotate_left(view % n);
        all
    };
    cameras.iter().enumerate().map(of_view).collect()
}

pub(crate) fn found(cameras: &[Camera], people: &[([f64; 2], f64)]) -> Found {
    of_views(cameras, seen(cameras, people))
}

fn of_views(cameras: &[Camera], views: Vec<Vec<FoundBody>>) -> Found {
    let cameras: Vec<&Camera> = cameras.iter().collect();
    let people = distinct(&views, groups(&cameras, &views));
    Found { views, people }
}

fn cameras(n: usize) -> Vec<Camera> {
    (0..n).map(camera).collect()
}

#[test]
fn three_people_are_found_in_the_right_places_sorted_by_clarity() {
    let cameras = cameras(4);
    let people = [([-1.0, 0.4], 0.6), ([0.9, 0.8], 1.0), ([0.2, -1.1], 0.8)];
    let found = found(&cameras, &people).people;
    let places: Vec<[f64; 2]> =
        found.iter().map(|person| [person.place.x, person.place.y]).collect();
    assert_eq!(places.len(), 3, "{places:?}");
    for (got, index) in places.iter().zip([1, 2, 0]) {
        let [x, y] = people[index].0;
        assert!((got[0] - x).hypot(got[1] - y) < 1e-6, "{places:?}");
    }
    assert!(found.iter().all(|person| person.n_views() == 4));
}

#[test]
fn a_person_seen_by_two_views_is_accepted_with_two_cameras_and_not_with_four() {
    let people = [([0.0, 0.0], 1.0), ([0.3, 1.4], 1.0)];
    let four = cameras(4);
    let mut views = seen(&four, &people);
    for view in [2, 3] {
        views[view] = vec![sighting(&four[view], [0.0, 0.0], 1.0)];
    }
    assert_eq!(of_views(&four, views).people.len(), 1);
    assert_eq!(found(&cameras(2), &people).people.len(), 2);
}

#[test]
fn a_person_much_less_clear_than_the_first_is_rejected() {
    let people = |strength| found(&cameras(4), &[([0.0, 0.0], 1.0), ([1.0, 0.5], strength)]).people;
    assert_eq!(people(MIN_STRENGTH + 0.01).len(), 2);
    assert_eq!(people(MIN_STRENGTH - 0.01).len(), 1);
}

#[test]
fn a_second_candidate_of_the_same_person_is_not_a_second_person() {
    let cameras = cameras(4);
    let people = [([0.0, 0.0], 1.0), ([0.08, 0.05], 0.9)];
    assert_eq!(found(&cameras, &people).people.len(), 1);
}

#[test]
fn joints_that_do_not_form_a_body_are_rejected() {
    let cameras = cameras(4);
    let doll = |camera: &Camera| {
        let mut it = sighting(camera, [0.0, 0.0], 1.0);
        let line = [0.35, 0.3, 0.2, 0.1, 0.02].map(|z| Point3::new(0.0, 0.0, z));
        it.points_px = line.map(|line| <[f64; 2]>::from(camera.project(&line).unwrap()));
        it.rays = it.points_px.map(|[x, y]| camera.ray(&Point2::new(x, y)));
        it
    };
    let views = cameras.iter().map(|camera| vec![doll(camera)]).collect();
    assert_eq!(of_views(&cameras, views).people, []);
}

#[test]
fn poor_views_are_left_out_but_never_all_of_them() {
    let cameras = cameras(3);
    let mut found = found(&cameras, &[([0.0, 0.0], 1.0), ([1.2, 0.5], 0.8)]);
    // In view v, person p is candidate (p - v) mod 2.
    assert_eq!(found.others(Some(0)), [0b10, 0b01, 0b10]);
    assert_eq!(found.others(Some(1)), [0b01, 0b10, 0b01]);
    assert_eq!(found.others(None), [0, 0, 0], "nothing would be left");
    // The first person is hidden in the last view, which shows only the other one.
    found.views[2].remove(0);
    found.people[0].candidates[2] = None;
    found.people[1].candidates[2] = Some(0);
    assert_eq!(found.others(Some(0)), [0b10, 0b01, 0]);
}

#[test]
fn views_without_candidates_or_with_invalid_points_give_no_people() {
    let cameras = cameras(3);
    assert_eq!(found(&cameras, &[]).people, []);
    let mut views = seen(&cameras, &[([0.0, 0.0], 1.0)]);
    for it in views.iter_mut().flatten() {
        it.points_px = [[f64::NAN; 2]; N_POINTS];
        it.rays = [None; N_POINTS];
    }
    assert_eq!(of_views(&cameras, views).people, []);
}

proptest! {
    #[test]
    fn people_do_not_overlap_and_their_candidates_exist(
        people in proptest::collection::vec(([-1.5..1.5_f64, -1.5..1.5], 0.1..1.0_f64), 0..5),
    ) {
        let cameras = cameras(4);
        let found = found(&cameras, &people);
        for (index, it) in found.people.iter().enumerate() {
            for (view, candidate) in it.candidates.iter().enumerate() {
                prop_assert!(candidate.is_none_or(|candidate| candidate < found.views[view].len()));
            }
            for other in &found.people[..index] {
                prop_assert!((it.place - other.place).norm() >= APART_M);
            }
        }
    }
}
