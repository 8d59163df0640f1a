//! Tests of the page with text that would break it, and with numbers that are not finite.

use calibration::board::{Doubt, Known, OutOfStep, Residual};
use geometry::{Camera, Intrinsics, Lens};
use nalgebra::{Isometry3, Vector2};

use super::*;

fn outcome(doubts: Vec<Doubt>) -> Outcome {
    let camera = CameraOutcome {
        camera: Camera {
            name: "cam".to_owned(),
            intrinsics: Intrinsics {
                fx: 900.0,
                fy: 901.0,
                cx: 640.0,
                cy: 360.0,
                size: [1280, 720],
                lens: Lens::default(),
            },
            camera_from_world: Isometry3::identity(),
        },
        is_known: false,
        n_boards: [12, 9],
        residuals: vec![Residual {
            frame: 3,
            id: 1,
            at: Point2::new(100.0, 200.0),
            off: Vector2::new(0.2, f64::NAN),
            is_wrong: false,
        }],
        rms_px: f64::NAN,
        rms_of_all_px: 0.4,
        coverage: 0.5,
        numbers: vec![Known {
            name: "focal length".to_owned(),
            value: 900.0,
            sd: f64::INFINITY,
        }],
    };
    Outcome {
        cameras: vec![camera.clone(), camera],
        pairs: Vec::new(),
        boards: vec![(3, Isometry3::translation(0.0, 0.0, 1.0))],
        sigma_px: 0.2,
        out_of_step: Some(OutOfStep {
            alone_px: 0.3,
            together_px: 1.2,
            bent: 0.1,
        }),
        doubts,
    }
}

#[test]
fn the_calibration_page_shows_results_and_warnings() {
    let names = ["<left>".to_owned(), "right".to_owned()];
    let page = |outcome: &Outcome, more: &[String]| {
        html(&Page {
            names: &names,
            outcome,
            has_rig: true,
            outline: [[0.0, 0.0], [0.2, 0.0], [0.2, 0.1], [0.0, 0.1]].map(Point2::from),
            about: &[("board".to_owned(), "a & b".to_owned())],
            more_doubts: more,
            worst: &[("<caption>".to_owned(), vec![1, 2, 3])],
        })
    };
    let good = page(&outcome(Vec::new()), &[]);
    assert!(
        good.contains("calibrated") && good.contains("&lt;left&gt;"),
        "{good}"
    );
    assert!(
        good.contains("a &amp; b") && good.contains("&lt;caption&gt;"),
        "{good}"
    );
    assert!(!good.contains(">NaN") && !good.contains(">inf"), "{good}");
    testkit::chromium::check_in_browser(&good);
    let doubt = Doubt::FewBoards { camera: 0, n: 2 };
    let bad = page(&outcome(vec![doubt]), &["mirrored".to_owned()]);
    assert!(bad.contains("doubtful") && bad.contains("in only 2 pictures"));
    assert!(bad.contains("mirrored"));
}
