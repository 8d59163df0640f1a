//! Tests that cards are read back as written, and that invalid entries are rejected by name.

use proptest::prelude::*;

use super::*;

fn rejection(name: &str, value: &str) -> String {
    Card::parse([(name, value)], 3).unwrap_err().to_string()
}

#[test]
fn a_file_without_entries_gets_the_defaults() {
    let card = Card::parse([("producer", "somebody")], 26).unwrap();
    assert_eq!(card, Card::default());
    assert_eq!((card.unit, card.tile), (Unit::Pixels, None));
    assert_eq!(card.colours, Normalisation::IMAGENET);
}

#[test]
fn a_logarithmic_output_is_relative_to_the_tile() {
    let px = Unit::LogRelative.error(2.0_f32.ln(), 400.0).unwrap();
    assert!((px - 4.0).abs() < 1e-5, "{px}: one hundredth of 400");
    assert_eq!(Unit::Relative.error(0.25, 400.0), Some(100.0));
    assert_eq!(Unit::Pixels.error(7.5, 400.0), Some(7.5));
}

#[test]
fn a_negative_output_is_zero_and_one_that_is_not_finite_is_rejected() {
    for unit in [Unit::Pixels, Unit::Relative, Unit::LogRelative] {
        assert_eq!(unit.error(-3.0, 100.0), Some(0.0));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(unit.error(bad, 100.0), None);
        }
    }
    assert_eq!(Unit::LogRelative.error(1e4, 100.0), None);
}

#[test]
fn thresholds_scale_with_the_person_unless_they_are_in_pixels() {
    let mut card = Card {
        tau: vec![0.5, 0.25],
        ..Card::default()
    };
    let px = |card: &Card| card.tau_px(200.0).collect::<Vec<f32>>();
    assert_eq!(px(&card), [0.5, 0.25]);
    card.unit = Unit::LogRelative;
    assert_eq!(px(&card), [100.0, 50.0]);
}

#[test]
fn rejects_unknown_entries_and_values_by_name() {
    assert_eq!(
        rejection("parallax.version", "2"),
        "`parallax.version` is `2`, expected 1"
    );
    assert_eq!(
        rejection("parallax.evidence", "x"),
        "`parallax.evidence` is `x`, expected 1"
    );
    assert_eq!(
        rejection("parallax.sigma", "1"),
        "`parallax.sigma` is not an entry of version 1"
    );
    assert_eq!(
        rejection("parallax.output", "metres"),
        "`parallax.output` is `metres`, expected `pixels`, `relative` or `log-relative`"
    );
    for bad in ["160", "0x64", "160x2000", "-1x5", "160x64x3"] {
        assert!(rejection("parallax.tile", bad).contains("as `160x64`"));
    }
    for bad in ["1 2", "1 2 3 4", "1 2 NaN", "a b c"] {
        assert!(rejection("parallax.mean", bad).ends_with("expected three numbers"));
    }
    assert!(rejection("parallax.std", "1 0 1").ends_with("three numbers above 0"));
    for bad in ["1 2", "1 2 -3", "1 2 inf"] {
        assert!(
            rejection("parallax.tau", bad).ends_with("expected 3 finite numbers of at least 0")
        );
    }
}

fn any_card() -> impl Strategy<Value = Card> {
    let side = 1..=MAX_SIDE;
    let tile = (side.clone(), side).prop_map(|(height, width)| TileShape { height, width });
    let colours = (
        prop::array::uniform3(-1.0_f32..2.0),
        prop::array::uniform3(1e-3_f32..2.0),
    );
    (
        prop::option::of(tile),
        colours,
        any::<bool>(),
        0..3_usize,
        "[ -~]{0,20}",
        prop_oneof![Just(Vec::new()), prop::collection::vec(0.0_f32..1e3, 3)],
    )
        .prop_map(
            |(tile, (mean, deviation), sees, unit, identity, tau)| Card {
                tile,
                colours: Normalisation { mean, deviation },
                evidence: sees.then_some(EVIDENCE_VERSION),
                unit: [Unit::Pixels, Unit::Relative, Unit::LogRelative][unit],
                identity,
                tau,
            },
        )
}

proptest! {
    #[test]
    fn a_written_card_is_read_back(card in any_card()) {
        let entries = card.entries();
        let entries = entries.iter().map(|(name, value)| (*name, value.as_str()));
        prop_assert_eq!(Card::parse(entries, 3).unwrap(), card);
    }

    #[test]
    fn an_error_is_recovered_from_its_label(error in 0.0_f64..1e3, height in 10.0_f64..1e3) {
        for unit in [Unit::Pixels, Unit::Relative, Unit::LogRelative] {
            let back = unit.error(unit.label(error, height) as f32, height).unwrap();
            prop_assert!((f64::from(back) - error).abs() < 1e-5 * (error + height));
        }
    }

    #[test]
    fn any_entries_are_a_card_or_an_error(name in "parallax.[a-z]{0,8}|parallax.(tile|mean|tau)", value: String) {
        let _outcome = Card::parse([(name.as_str(), value.as_str())], 3);
    }
}
