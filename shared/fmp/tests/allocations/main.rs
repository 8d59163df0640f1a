//! Checks that from the second frame on, only the results allocate memory, on any thread.
//!
//! This test runs without the test harness, because the harness's own thread allocates memory. The counter covers all threads, because the
//! threads of a pool do most of the work.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../single_view/common.rs"]
mod common;
mod extract;
mod solve;

use std::alloc::System;

use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Allocations and reallocations of all threads during `call`.
fn allocations(call: impl FnOnce()) -> usize {
    let region = Region::new(ALLOCATOR);
    call();
    let change = region.change();
    change.allocations + change.reallocations
}

/// Checks that frames after the first allocate memory for their results only.
fn main() {
    let mut some = Vec::new();
    let counted = allocations(|| some = std::hint::black_box(vec![1_u8; 100]));
    assert_eq!((counted, some.len()), (1, 100), "the counter counts");
    let elsewhere =
        || std::thread::scope(|scope| drop(scope.spawn(|| vec![1_u8; 100]).join().unwrap()));
    assert!(allocations(elsewhere) > 0, "and on all threads");
    solve::takes_memory_for_the_answer_only();
    solve::takes_memory_for_the_answer_only_again();
    // This check runs last, because the threads of its pool may still be ending after the pool has been dropped.
    extract::takes_no_memory();
}
