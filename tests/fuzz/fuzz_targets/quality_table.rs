//! Tables of expected errors, and thresholds.
#![no_main]

use viewquality::{Table, Tau};

libfuzzer_sys::fuzz_target!(|input: &str| {
    if let Ok(table) = Table::parse(input, 2) {
        assert!(table.n_rows() > 0);
    }
    if let Ok(tau) = Tau::parse(input, 2) {
        assert!(tau.px().iter().all(|it| it.is_finite()));
    }
});
