//! Tests of the program as a user runs it. There is only one test binary, because linking takes longer than most tests.

mod common;

mod bad_input;
mod bench;
mod book;
mod calibrate;
mod chaos;
mod demo;
mod detect;
mod detectors;
mod entering;
mod everybody;
mod export;
mod faults;
mod full;
mod gpu;
mod handstand;
mod live;
mod maps;
#[cfg(feature = "long-tests")]
mod memory;
mod networks;
mod nonsense;
mod one_process;
mod parity;
mod processes;
mod programs;
mod quality;
mod realtime;
mod record;
mod remains;
mod resources;
mod rogue;
mod scheduling;
mod search_size;
mod smooth;
mod sync;
mod told;
mod view;
